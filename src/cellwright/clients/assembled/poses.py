"""Poses as programs of the io_teleop stack have them: [[x, y, z], [qx, qy, qz, qw]], without numpy."""

from __future__ import annotations

from typing import Sequence

from cellwright.util.errors import UsageError

Pose = Sequence[Sequence[float]]


def as_numbers(pose: Pose) -> list[list[float]]:
    """A pose as plain lists, whatever sequences it is made of.

    Raises:
        UsageError: it is none.
    """
    try:
        position, orientation = ([float(value) for value in part] for part in pose)
    except (TypeError, ValueError):
        position, orientation = [], []
    if len(position) != 3 or len(orientation) != 4:
        raise UsageError("a pose is [[x, y, z], [qx, qy, qz, qw]]")
    return [position, orientation]


def multiplied(a_T_b: Pose, b_T_c: Pose) -> list[list[float]]:
    """a_T_c."""
    (position, turn), (way, further) = a_T_b, b_T_c
    return [[p + w for p, w in zip(position, _turned(turn, way))], _product(turn, further)]


def inverted(a_T_b: Pose) -> list[list[float]]:
    """b_T_a, for a unit quaternion."""
    position, (x, y, z, w) = a_T_b
    back = [-x, -y, -z, w]
    return [[-value for value in _turned(back, position)], back]


def _turned(turn: Sequence[float], vector: Sequence[float]) -> list[float]:
    x, y, z, w = turn
    way = _product(_product(turn, [*vector, 0.0]), [-x, -y, -z, w])
    return way[:3]


def _product(first: Sequence[float], second: Sequence[float]) -> list[float]:
    ax, ay, az, aw = first
    bx, by, bz, bw = second
    return [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]
