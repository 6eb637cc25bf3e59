"""Which posture the arm takes for a tool pose: elbow up and hand outwards, as all stations are worked in."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

from cellwright.motion import Joints, inverse, solve
from cellwright.util.errors import UnreachableError
from cellwright.util.pose import Pose

RAIL_END = 2.1
"""How far the rail reaches to either side [m]."""

SHOULDER_OFFSET = 0.163941
"""How far [m] the arm's plane is beside its base (d4)."""

BASE_X = 0.3
"""World x [m] of the arm's base."""

FOLDED = 0.38
"""How far [m] the tool is in front of the base on the way from one station to another."""

FOLDED_HEIGHT = 1.12
"""Height [m] of the gripper link then: what it holds clears the beam of the rail."""


def station_posture(goal: Pose, rail: float, present: Sequence[float]) -> Joints | None:
    """Joints for a tool pose, in the posture that all stations are worked in; None if it is out of reach.

    Args:
        goal: world_T_gripper.
        rail: where the rail is to be [m]; at most at its end.
        present: where the joints are now; of the whole turns, those nearest to it are taken.
    """
    rail = on_rail(rail)
    pan = station_pan(goal.position[0], goal.position[1], rail)
    favoured = Joints(*present)._replace(shoulder_pan=pan)
    try:
        return solve(goal, favoured, rail=rail, accept=partial(faces, pan=pan))
    except UnreachableError:
        return None


def near_posture(goal: Pose, rail: float, near: Sequence[float]) -> Joints | None:
    """Joints for a tool pose, as near as can be to other joint positions; None if it is out of reach.

    Args:
        goal: world_T_gripper.
        rail: where the rail is [m].
        near: joint positions.
    """
    try:
        return closest(inverse(goal, on_rail(rail), near=Joints(*near)), near)
    except UnreachableError:
        return None


def folded(joints: Sequence[float], present: Sequence[float], higher: float = 0.0) -> list[float]:
    """The arm drawn in, so as to pass between the posts of the frame over the bins.

    Args:
        joints: rail, pan and wrist 3 are as here.
        present: where the joints are now.
        higher: how much higher than usual the tool is kept [m], for a tall part on the cup.
    """
    given = Joints(*joints)
    rail, pan = on_rail(given.rail), given.shoulder_pan
    cos, sin = math.cos(pan), math.sin(pan)
    x = BASE_X + FOLDED * cos - SHOULDER_OFFSET * sin
    y = rail + FOLDED * sin + SHOULDER_OFFSET * cos
    drawn_in = station_posture(Pose.from_rpy((x, y, FOLDED_HEIGHT + higher), (0.0, 0.0, pan)), rail, present)
    if drawn_in is None:
        return list(joints)
    return [given.rail, pan, *drawn_in[2:6], given.wrist_3]


def on_rail(place: float) -> float:
    """The place on the rail [m] that is nearest to one that may be beyond its end."""
    return max(-RAIL_END, min(RAIL_END, place))


def faces(joints: Joints, pan: float) -> bool:
    """Whether the arm works a station the usual way: its plane turned to it by `pan` [rad], the hand reaching out."""
    return abs(joints.shoulder_pan - pan) < 0.3 and math.sin(joints.wrist_2) < 0.0


def closest(postures: Sequence[Joints], near: Sequence[float]) -> Joints:
    """The posture that differs least from joint positions; wrist 3 and the rail are left out."""
    return min(postures, key=lambda each: math.dist(each[1:6], near[1:6]))


def station_pan(x: float, y: float, rail: float) -> float:
    """The pan [rad] that turns the arm's plane to a point of the world, from -pi/4 to 7 pi/4."""
    dx, dy = x - BASE_X, y - rail
    distance = max(math.hypot(dx, dy), SHOULDER_OFFSET + 0.01)
    pan = math.atan2(dy, dx) - math.asin(SHOULDER_OFFSET / distance)
    return pan + 2 * math.pi if pan < -math.pi / 4 else pan
