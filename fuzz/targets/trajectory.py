"""Commanded trajectories, one after the other: each is followed in finite numbers, or refused whole."""

from __future__ import annotations

import json
from collections.abc import Iterator
from math import isfinite

from cellwright.cell.interface.commands import trajectory_of
from cellwright.config.arm import ARM_JOINTS
from cellwright.mechanism.trajectory_controller import JointTrajectoryController, RejectedTrajectoryError
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.conversions import joint_trajectory, trajectory_point
from cellwright.middleware.messages.standard import JointTrajectory
from cellwright.util.errors import MessageError
from fuzz.verdict import FindingError

MAX_SIZE = 6000
WORDS = (
    *ARM_JOINTS,
    "\0\0\0\0\0\0\xf0\x7f",
    "\0\0\0\0\0\0\xf8\x7f",
    "\xff\xff\xff\xff\xff\xff\xef\x7f",
    "\xff\xff\xff\xff",
)
_SECOND = 10**9


def seeds() -> Iterator[bytes]:
    """Yield straight paths, smooth ones, one that begins later, one without points, and two in a row."""
    straight = [trajectory_point([0.1 * n] * 7, time_from_start=n * _SECOND) for n in (1, 2, 3)]
    smooth = [trajectory_point([0.2] * 7, [0.1] * 7, [0.0] * 7, time_from_start=_SECOND)]
    found = [
        TYPES.to_ros1(joint_trajectory(ARM_JOINTS, points, time=time))
        for points, time in ((straight, 0), (smooth, 0), (straight, 2 * _SECOND), ([], 0))
    ]
    yield from (_with_length(each) for each in found)
    yield _with_length(found[0]) + _with_length(found[1])


def attempt(data: bytes) -> None:
    """Command the trajectories in the bytes, half a second apart."""
    controller = JointTrajectoryController(ARM_JOINTS)
    now = 0
    while len(data) > 2 and now < 5 * _SECOND:
        length = int.from_bytes(data[:2], "little")
        piece, data = data[2 : 2 + length], data[2 + length :]
        now += _SECOND // 2
        before = json.dumps(controller.get_state())
        try:
            controller.command(trajectory_of(TYPES.checked(TYPES.from_ros1(piece, JointTrajectory))), now)
        except (MessageError, RejectedTrajectoryError) as error:
            if json.dumps(controller.get_state()) != before:
                raise FindingError(f"refused, and not whole: {error!r:.200}") from None
        for ahead in (0, 1, _SECOND // 3, 10 * _SECOND, 1 << 62):
            if not all(map(isfinite, controller.positions(now + ahead))):
                raise FindingError(f"positions {controller.positions(now + ahead)}")
        kept = json.dumps(controller.get_state())
        controller.set_state(json.loads(kept))
        if json.dumps(controller.get_state()) != kept:
            raise FindingError("it is another one after it was kept")


def _with_length(data: bytes) -> bytes:
    return len(data).to_bytes(2, "little") + data
