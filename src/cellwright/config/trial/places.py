"""Where a point of the 2017 cell is, and whether the arm gets there: for telling what a trial asks for.

Figures: the cell's published models and the UR10's kinematic constants (m, world frame).
"""

from __future__ import annotations

import math

from cellwright.config.layout import BIN_CENTRES, BIN_WIDTH, RAIL_LIMIT, TRAY_FRAMES
from cellwright.util.pose import Vector3

TRAY_LENGTHS = (0.5, 0.7)
"""Length of a tray's plate along x and y of its frame [m]; the AGVs stand so that these are the world's as well."""

_TRAY_TOP = 0.755
_BIN_TOP = 0.725
_BELT_TOP = 0.907
_BELT_SIDES = (0.883, 1.537)

_RAIL_X = 0.3
_SHOULDER_HEIGHT = 1.1273
_ARM_LENGTH = 0.612 + 0.5723
_WRIST_LENGTH = 0.1157
_HAND_LENGTH = 0.11


def place_of(point: Vector3) -> str:
    """What lies under a point of the world [m]: "AGV 1", "bin 7", "the belt", else "the floor"."""
    x, y, _ = point
    for number, frame in enumerate(TRAY_FRAMES.values(), start=1):
        if _within(x - frame.position[0], TRAY_LENGTHS[0]) and _within(y - frame.position[1], TRAY_LENGTHS[1]):
            return f"AGV {number}"
    for name, (bin_x, bin_y) in BIN_CENTRES.items():
        if _within(x - bin_x, BIN_WIDTH) and _within(y - bin_y, BIN_WIDTH):
            return name.replace("bin", "bin ")
    return "the belt" if _BELT_SIDES[0] <= x <= _BELT_SIDES[1] else "the floor"


def is_on_tray(x: float, y: float) -> bool:
    """Whether a point of a tray's frame [m] lies on its plate."""
    return _within(x, TRAY_LENGTHS[0]) and _within(y, TRAY_LENGTHS[1])


def is_within_reach(point: Vector3) -> bool:
    """Whether the arm can lower its cup, pointing down, to what has fallen at this point of the world.

    The part comes to rest on what is under the point. Upper arm and forearm, both stretched, have to span the way from
    the shoulder to the wrist, which the hand keeps above the part and which bends once more towards it. What stands
    in the way is not looked at, so a point may be out of reach all the same.
    """
    x, y, _ = point
    place = place_of(point)
    top = {"AGV": _TRAY_TOP, "bin": _BIN_TOP, "the": _BELT_TOP if place == "the belt" else 0.0}[place.split()[0]]
    beside = math.hypot(x - _RAIL_X, max(abs(y) - RAIL_LIMIT, 0.0))
    below = _SHOULDER_HEIGHT - (top + _HAND_LENGTH)
    return math.hypot(max(beside - _WRIST_LENGTH, 0.0), below) <= _ARM_LENGTH


def _within(offset: float, length: float) -> bool:
    return abs(offset) <= length / 2 + 1e-9
