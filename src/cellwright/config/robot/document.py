"""A robot as programs read it: JSON values in SI units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cellwright.config.robot.arrangement import groups
from cellwright.config.robot.config import End, RobotConfig
from cellwright.config.robot.config_keys import UNUSED
from cellwright.config.robot.group_reader import AXES_OF_HEAD
from cellwright.config.robot.model import ROOT, Joint, JointType
from cellwright.config.robot.posture import link_poses
from cellwright.util.pose import Pose


def document(config: RobotConfig, positions: Mapping[str, float] | None = None) -> dict[str, Any]:
    """A robot with its joints in the order of their indices, its groups, and where its links are.

    Args:
        config: the robot.
        positions: of joints by name [rad; m], for the poses of the links; all at 0 when left out.
    """
    robot = config.robot
    return {
        "name": config.name,
        "file": str(config.path),
        "urdf": str(config.urdf_path),
        "root": robot.root,
        "base_pose": _pose(config.base_pose),
        "fixed_link": config.fixed_link,
        "joints": [_joint(config, joint) for joint in robot.joints],
        "links": {name: _pose(pose) for name, pose in link_poses(robot, positions or {}).items()},
        "groups": _groups(config),
        "home": config.home,
        "cameras": [camera.name for camera in config.cameras],
        "not_used": [key for key in config.others if key in UNUSED],
    }


def parent_index(config: RobotConfig, joint: Joint) -> int:
    """Index of the link that a joint is fastened to; -1 is the root's."""
    return config.robot.link_indices.get(joint.parent, ROOT)


def groups_of(config: RobotConfig, joint: Joint) -> list[str]:
    """The groups that a joint is in, by their keys in the file."""
    return [key for key, joints, _ in groups(config) if joint.name in joints]


def _joint(config: RobotConfig, joint: Joint) -> dict[str, Any]:
    limits, is_fixed = joint.limits, joint.type is JointType.FIXED
    return {
        "index": config.robot.joint_indices[joint.name],
        "name": joint.name,
        "type": str(joint.type),
        "link": joint.child,
        "parent": joint.parent,
        "parent_index": parent_index(config, joint),
        # as the engine of the original reports joints that nothing moves
        "lower": 0.0 if is_fixed else _finite(limits.lower),
        "upper": -1.0 if is_fixed else _finite(limits.upper),
        "effort": 0.0 if is_fixed else _finite(limits.effort),
        "velocity": 0.0 if is_fixed else _finite(limits.velocity),
        "axis": [0.0, 0.0, 0.0] if is_fixed else list(joint.axis),
        "mimic": None
        if joint.mimic is None
        else {"joint": joint.mimic.joint, "multiplier": joint.mimic.multiplier, "offset": joint.mimic.offset},
        "groups": groups_of(config, joint),
        "home": config.home.get(joint.name),
        "max_acceleration": config.max_accelerations.get(joint.name),
    }


def _groups(config: RobotConfig) -> dict[str, Any]:
    found: dict[str, Any] = {
        "arms": [
            {
                "joints": list(arm.joints),
                "tip": arm.tip,
                "home": list(arm.home),
                "command_link": command,
                "reference_link": reference or config.robot.root,
            }
            for arm, command, reference in zip(config.arms, config.command_links, config.reference_links, strict=True)
        ],
        "grippers": [
            {
                "joints": list(gripper.joints),
                "open": list(gripper.open_ends) or [End.LOWER] * len(gripper.joints),
            }
            for gripper in config.grippers
        ],
    }
    for name in ("head", "waist", "dorsal"):
        group = getattr(config, name)
        found[name] = None if group is None else {"joints": list(group.joints), "home": list(group.home)}
    if config.head is not None:
        found["head"]["axes"] = [AXES_OF_HEAD[axis] for axis in config.head_axes]
    return found


def _pose(pose: Pose) -> list[list[float]]:
    """Position [m] and quaternion (x, y, z, w), as in messages."""
    w, x, y, z = pose.quaternion
    return [list(pose.position), [x, y, z, w]]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
