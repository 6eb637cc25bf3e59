"""Open ends of a gripper's joints, guessed from the kinematics of its fingers.

Two fingers are open where they are farther apart, a single one where it is farther from its palm. Hands with more
fingers, and fingers with more than one joint of their own, close in other ways: nothing is guessed for them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from cellwright.config.robot.config import End
from cellwright.config.robot.model import Joint, RobotModel
from cellwright.config.robot.posture import link_poses
from cellwright.util.pose import Pose

CLEAR = 0.2
"""Least change of the distance, as a share of a finger's way, that tells the open end from the closed one."""

_MIN_WAY = 1e-6  # [m]; a finger whose centre does not move tells nothing

Vector = NDArray[np.float64]


def find_open_ends(robot: RobotModel, names: Sequence[str]) -> tuple[End, ...] | None:
    """The end of its range at which each joint of a gripper is open; None where the kinematics do not tell.

    Args:
        robot: the robot.
        names: the gripper's joints; those that mimic another get the end of the joint that they follow.
    """
    joints = [robot.joint(name) for name in names]
    leaders = [joint for joint in joints if joint.mimic is None]
    fingers = _fingers(robot, joints)
    if len(fingers) > 2 or any(sum(joint in leaders for joint in finger) > 1 for finger in fingers):
        return None
    other = fingers[1] if len(fingers) == 2 else None
    found: dict[str, End] = {}
    for leader in leaders:
        end = _open_end(robot, leaders, leader, fingers[0], other)
        if end is None:
            return None
        found[leader.name] = end
    return tuple(found[_leader(robot, joint).name] for joint in joints)


def _fingers(robot: RobotModel, joints: Sequence[Joint]) -> list[list[Joint]]:
    """The driven joints of each branch that hangs on the palm and has one of a gripper's joints."""
    palms = {joint.parent for joint in joints} - {joint.child for joint in joints}
    behind = {joint.name: robot.chain(joint.child) for joint in robot.driven}
    first = [joint for joint in robot.driven if joint.parent in palms and _moves(robot, joint, joints)]
    return [[joint for joint in robot.driven if each in behind[joint.name]] for each in first]


def _moves(robot: RobotModel, joint: Joint, joints: Sequence[Joint]) -> bool:
    return joint in joints or _leader(robot, joint) in joints


def _leader(robot: RobotModel, joint: Joint) -> Joint:
    seen = {joint.name}
    while joint.mimic is not None and joint.mimic.joint not in seen:
        joint = robot.joint(joint.mimic.joint)
        seen.add(joint.name)
    return joint


def _open_end(
    robot: RobotModel, leaders: Sequence[Joint], leader: Joint, finger: Sequence[Joint], other: Sequence[Joint] | None
) -> End | None:
    """The end at which a finger is farther from the other one, or from the palm, along the way that it moves."""
    if other is None and not _has_centre(robot, finger[0].parent):
        return None
    own = [joint.child for joint in finger]
    opposite = [finger[0].parent] if other is None else [joint.child for joint in other]
    leaders = [leader, *(joint for joint in leaders if joint is not leader)]
    apart: list[Vector] = []  # with this joint at its lower limit and then at its upper one, for each place of the rest
    for corner in product(*((joint.limits.lower, joint.limits.upper) for joint in reversed(leaders))):
        poses = link_poses(robot, {joint.name: at for joint, at in zip(reversed(leaders), corner, strict=True)})
        apart.append(_centre(robot, poses, own) - _centre(robot, poses, opposite))
    way = apart[1] - apart[0]
    length = float(np.linalg.norm(way))
    if length < _MIN_WAY:
        return None
    along = np.array(apart) @ way / length
    clear = CLEAR * length
    passes = along.min() < -clear and along.max() > clear  # two fingers do not go through each other: centres mislead
    lower, upper = np.abs(along[:2])
    if passes or abs(upper - lower) < clear:
        return None
    return End.UPPER if upper > lower else End.LOWER


def _centre(robot: RobotModel, poses: Mapping[str, Pose], links: Sequence[str]) -> Vector:
    """The middle of some links' centres in the root's frame (3) [m]."""
    found: Vector = np.mean([(poses[link] @ _own_centre(robot, link)).position for link in links], axis=0)
    return found


def _own_centre(robot: RobotModel, link: str) -> Pose:
    """The centre of mass of a link in its frame, else that of its first shape, else its origin."""
    found = robot.links[link]
    if found.inertial is not None:
        return found.inertial.pose
    return found.shapes[0].pose if found.shapes else Pose()


def _has_centre(robot: RobotModel, link: str) -> bool:
    return robot.links[link].inertial is not None or bool(robot.links[link].shapes)
