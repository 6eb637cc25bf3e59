"""Where the links of a robot are in a given posture: forward kinematics, without any engine."""

from __future__ import annotations

import math
from collections.abc import Mapping

from cellwright.config.robot.model import Joint, JointType, RobotModel
from cellwright.util.pose import Pose


def link_poses(robot: RobotModel, positions: Mapping[str, float], world_T_root: Pose | None = None) -> dict[str, Pose]:
    """The pose of each link frame in the world, by name.

    Args:
        robot: the robot.
        positions: of joints by name [rad; m]; joints that are missing stand at 0, but for those that follow another.
        world_T_root: where the root link is; the identity when left out.
    """
    poses = {robot.root: world_T_root or Pose()}
    for joint in robot.joints:
        poses[joint.child] = poses[joint.parent] @ parent_T_child(joint, position_of(robot, joint, positions))
    return poses


def position_of(robot: RobotModel, joint: Joint, positions: Mapping[str, float]) -> float:
    """The position of a joint [rad; m]: its own, or what follows from the joint that it mimics."""
    if joint.mimic is not None and joint.name not in positions:
        leader = robot.joint(joint.mimic.joint)
        return joint.mimic.multiplier * position_of(robot, leader, positions) + joint.mimic.offset
    return positions.get(joint.name, 0.0)


def parent_T_child(joint: Joint, position: float) -> Pose:
    """The child link's frame in its parent's, at a position [rad; m]; other joints than driven ones stand at 0."""
    if joint.type is JointType.PRISMATIC:
        x, y, z = joint.axis
        return joint.origin @ Pose((position * x, position * y, position * z))
    if not joint.is_driven:
        return joint.origin
    sine, cosine = math.sin(position / 2), math.cos(position / 2)
    x, y, z = joint.axis
    return joint.origin @ Pose(quaternion=(cosine, sine * x, sine * y, sine * z))
