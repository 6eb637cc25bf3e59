"""Tool paths as timed poses, and velocities along them."""

import math
from collections.abc import Iterator, Sequence
from typing import TypeAlias

from cellwright.util.pose import Pose, Vector3

FOLLOW_LEAD = 0.2
"""Lead [s] with which following begins before the part is under the tool: it takes 0.4 s to come up to speed."""
FOLLOW_TIME = 1.9
"""Time [s] that a part is followed."""
_LINE_STEP = 0.01
_FOLLOW_STEP = 0.05
_DESCENT_TIME, _PRESS_TIME = 0.55, 0.5


def ease_in_out(share: float) -> float:
    """Return the time at which a share of a path with a smooth start and stop is done, as a share of its duration."""
    # Inverse of share = t^2 (3 - 2 t), the cubic that starts and stops at rest. With t = 1/2 - sin(u) it becomes
    # share = (1 - sin(3 u)) / 2, by the formula of the triple angle.
    return 0.5 - math.sin(math.asin(1 - 2 * share) / 3)


def velocities_along(
    start: Sequence[float], points: Sequence[Sequence[float]], times: Sequence[float]
) -> list[list[float]]:
    """Return velocities at joint positions after `start` at time 0: the slope between neighbours, rest at the end."""
    places = [list(start), *map(list, points)]
    moments = [0.0, *times]
    slopes = [
        [(after - before) / (moments[index + 1] - moments[index - 1]) for before, after in zip(a, b, strict=True)]
        for index, (a, b) in enumerate(zip(places, places[2:], strict=False), start=1)
    ]
    return [*slopes, [0.0] * len(start)]


TimedPose: TypeAlias = tuple[float, Pose]
"""A time from the start of the path [s], and world_T_gripper then."""


def straight_path(start: Pose, goal: Pose, speed: float) -> Iterator[TimedPose]:
    """Yield a straight path between tool poses with smooth start and stop, at about `speed` [m/s].

    The cup faces down all the way, or as in `goal` if it faces elsewhere there.
    """
    length = math.dist(start.position, goal.position)
    steps = max(2, math.ceil(length / _LINE_STEP))
    duration = max(length / speed, 0.05) + 0.15
    for step in range(1, steps + 1):
        share = step / steps
        yield duration * ease_in_out(share), interpolate(start, goal, share)


def following_path(
    start: Pose, near: float, press: float, speed: float, direction: Vector3 = (0.0, -1.0, 0.0)
) -> Iterator[TimedPose]:
    """Yield a tool path along with something that moves in a horizontal direction at `speed` [m/s], and down on it.

    The part passes under the tool pose `start` at `FOLLOW_LEAD` from now. The tool comes down to the height `near` [m]
    at full speed, and from there slowly to `press` [m].
    """
    x, y, z = start.position
    # At constant acceleration the tool covers half of the belt's way in the run-up. The part comes `FOLLOW_LEAD` late,
    # half the run-up: at its end both are at one place with one speed.
    run_up = 2 * FOLLOW_LEAD
    for step in range(1, round(FOLLOW_TIME / _FOLLOW_STEP) + 1):
        time = _FOLLOW_STEP * step
        distance = speed * time**2 / (2 * run_up) if time < run_up else speed * (time - run_up / 2)
        share = min(1.0, time / _DESCENT_TIME)
        height = z + (near - z) * share**2 * (3 - 2 * share)
        height += (press - near) * max(0.0, min(1.0, (time - _DESCENT_TIME) / _PRESS_TIME))
        yield time, Pose((x + direction[0] * distance, y + direction[1] * distance, height), start.quaternion)


def down_to(start: Pose, height: float) -> tuple[Pose, ...]:
    """Return tool poses straight down from one to a height [m]."""
    return tuple(pose for _, pose in straight_path(start, at_height(start, height), 1.0))


def poses_at_belt(
    start: Pose, press: float, rise: float, speed: float, direction: Vector3 = (0.0, -1.0, 0.0)
) -> tuple[Pose, ...]:
    """Return the tool's poses with a part of a belt: as in `following_path`, up to a height `rise` [m], and back there.

    It may rise anywhere between.
    """
    down = [pose for _, pose in following_path(start, press, press, speed, direction)]
    up = at_height(down[-1], rise)
    back = straight_path(up, at_height(start, rise), 1.0)
    return (*down, *down_to(up, press)[::-1], up, *(pose for _, pose in back))


def interpolate(start: Pose, goal: Pose, share: float) -> Pose:
    """Return a tool pose on the straight line between two.

    If the cup faces down in `goal`, it does so on the way, and the yaw turns the short way. Else it faces as in `goal`.
    """
    position = [a + (b - a) * share for a, b in zip(start.position, goal.position, strict=True)]
    if goal.rotate((0.0, 0.0, 1.0))[2] < 0.5:
        return Pose((position[0], position[1], position[2]), goal.quaternion)
    turn = math.remainder(goal.yaw - start.yaw, 2 * math.pi)
    return Pose.from_rpy((position[0], position[1], position[2]), (0.0, 0.0, start.yaw + turn * share))


def at_height(pose: Pose, height: float) -> Pose:
    """Return the pose at another height [m]."""
    return Pose((pose.position[0], pose.position[1], height), pose.quaternion)


def facing_down(pose: Pose) -> Pose:
    """Return the same place and yaw with the cup facing straight down."""
    return Pose.from_rpy(pose.position, (0.0, 0.0, pose.yaw))
