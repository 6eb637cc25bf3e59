"""Ways of the tool through the world, as poses at times: straight, and along with a part on the belt."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TypeAlias

from cellwright.clients.agents.kitter.timing import eased
from cellwright.util.pose import Pose

TimedPose: TypeAlias = tuple[float, Pose]
"""A time from the start of the way [s], and world_T_gripper then."""

FOLLOW_LEAD = 0.2
"""How long before the part is under the tool following it has to begin [s]: it takes 0.4 s to come up to speed."""

FOLLOW_TIME = 1.9
"""How long a part is followed [s]."""

_STEP = 0.01
_FOLLOW_STEP = 0.05
_DOWN, _SLOW = 0.55, 0.5


def straight_way(start: Pose, goal: Pose, speed: float) -> Iterator[TimedPose]:
    """Straight from a tool pose to another, gently at both ends.

    Args:
        start: where the tool is.
        goal: where it goes; the cup faces down all the way.
        speed: about how fast [m/s].
    """
    length = math.dist(start.position, goal.position)
    steps = max(2, math.ceil(length / _STEP))
    duration = max(length / speed, 0.05) + 0.15
    for step in range(1, steps + 1):
        share = step / steps
        yield duration * eased(share), between(start, goal, share)


def following_way(start: Pose, near: float, press: float, speed: float) -> Iterator[TimedPose]:
    """Along with something that moves along -y, down on it: first to a height, then slowly to another.

    Args:
        start: the tool pose that it passes under, `FOLLOW_LEAD` from now.
        near: height [m] to come down to as fast as it goes.
        press: height [m] to come down to slowly after that.
        speed: of what is followed [m/s].
    """
    x, y, z = start.position
    run_up = 2 * FOLLOW_LEAD
    for step in range(1, round(FOLLOW_TIME / _FOLLOW_STEP) + 1):
        time = _FOLLOW_STEP * step
        way = speed * time**2 / (2 * run_up) if time < run_up else speed * (time - run_up / 2)
        share = min(1.0, time / _DOWN)
        height = z + (near - z) * share**2 * (3 - 2 * share)
        height += (press - near) * max(0.0, min(1.0, (time - _DOWN) / _SLOW))
        yield time, Pose((x, y - way, height), start.quaternion)


def between(start: Pose, goal: Pose, share: float) -> Pose:
    """A tool pose on the straight way from one to another; the cup faces down, the yaw turns the short way."""
    position = [a + (b - a) * share for a, b in zip(start.position, goal.position, strict=True)]
    turn = math.remainder(goal.yaw - start.yaw, 2 * math.pi)
    return Pose.from_rpy((position[0], position[1], position[2]), (0.0, 0.0, start.yaw + turn * share))


def at_height(pose: Pose, height: float) -> Pose:
    """The same pose at another height [m]."""
    return Pose((pose.position[0], pose.position[1], height), pose.quaternion)


def facing_down(pose: Pose) -> Pose:
    """The same place and yaw, with the cup facing straight down."""
    return Pose.from_rpy(pose.position, (0.0, 0.0, pose.yaw))
