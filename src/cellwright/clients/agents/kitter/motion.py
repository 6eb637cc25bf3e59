"""Arm motion: joint postures for tool poses, tool paths as timed poses, and velocities along them."""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from typing import TypeAlias

from cellwright.motion import Joints, inverse, link_poses, solve
from cellwright.util.errors import UnreachableError
from cellwright.util.pose import Pose, Vector3

FOLLOW_LEAD = 0.2
"""Lead [s] with which following begins before the part is under the tool: it takes 0.4 s to come up to speed."""
FOLLOW_TIME = 1.9
"""Time [s] that a part is followed."""
_LINE_STEP = 0.01
_FOLLOW_STEP = 0.05
_DESCENT_TIME, _PRESS_TIME = 0.55, 0.5
RAIL_END = 2.1
"""Reach of the rail to either side [m]."""
SHOULDER_OFFSET = 0.163941
"""Distance [m] of the arm's plane beside its base (d4)."""
BASE_X = 0.3
"""x [m] of the arm's base in its frame."""
FOLDED = 0.38
"""Distance [m] of the tool in front of the base between stations."""
FOLDED_HEIGHT = 1.12
"""Height [m] of the gripper link then: what it holds clears the beam of the rail."""


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


def station_posture(goal: Pose, rail: float, present: Sequence[float]) -> Joints | None:
    """Return joints for a tool pose in the posture of all stations; None if it is out of reach.

    The rail is at `rail` [m] or its end; of the whole turns, those nearest to the `present` joints are taken.
    """
    rail = on_rail(rail)
    pan = station_pan(goal.position[0], goal.position[1], rail)
    favoured = Joints(*present)._replace(shoulder_pan=pan)
    try:
        return solve(goal, favoured, rail=rail, accept=partial(faces_station, pan=pan))
    except UnreachableError:
        return None


def side_posture(goal: Pose, rail: float, present: Sequence[float]) -> Joints | None:
    """Return joints for a tool pose whose cup faces sideways, with the wrist above the hand; None if out of reach.

    The forearm comes from above then, and nothing of the arm is lower than the hand.
    """
    try:
        return solve(goal, Joints(*present), rail=on_rail(rail), accept=_is_wrist_above_hand)
    except UnreachableError:
        return None


def _is_wrist_above_hand(joints: Joints) -> bool:
    links = link_poses(joints)
    return links["wrist_1_link"].position[2] > links["wrist_3_link"].position[2] + 0.1


def near_posture(goal: Pose, rail: float, near: Sequence[float]) -> Joints | None:
    """Return joints for a tool pose with the rail at `rail` [m], nearest to others; None if it is out of reach."""
    try:
        return closest(inverse(goal, on_rail(rail), near=Joints(*near)), near)
    except UnreachableError:
        return None


def folded(joints: Sequence[float], present: Sequence[float], higher: float = 0.0) -> list[float]:
    """Return the folded posture, in which the arm passes between the posts of the frame over the bins.

    Rail, pan and wrist 3 are as in `joints`; with a tall part on the cup the tool is kept `higher` than usual [m].
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
    """Return the place on the rail [m] nearest to one that may be beyond its end."""
    return max(-RAIL_END, min(RAIL_END, place))


def faces_station(joints: Joints, pan: float) -> bool:
    """Return whether the arm works a station as usual: its plane turned there by `pan` [rad], the hand forward."""
    return abs(joints.shoulder_pan - pan) < 0.3 and math.sin(joints.wrist_2) < 0.0


def closest(postures: Sequence[Joints], near: Sequence[float]) -> Joints:
    """Return the posture nearest to joint positions, wrist 3 and the rail disregarded."""
    return min(postures, key=lambda each: math.dist(each[1:6], near[1:6]))


def station_pan(x: float, y: float, rail: float) -> float:
    """Return the pan [rad] that turns the arm's plane to a point, from -pi/4 to 7 pi/4."""
    dx, dy = x - BASE_X, y - rail
    distance = max(math.hypot(dx, dy), SHOULDER_OFFSET + 0.01)
    # The arm's plane passes the shoulder's axis at SHOULDER_OFFSET: a right triangle with this leg, and the distance as
    # hypotenuse, has the angle between the plane and the point.
    pan = math.atan2(dy, dx) - math.asin(SHOULDER_OFFSET / distance)
    return pan + 2 * math.pi if pan < -math.pi / 4 else pan
