"""Models of arms: a robot's chain with the mount that carries it and the tool that it carries, as one description."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from cellwright.config.gripper_links import GripperNames, gripper_links
from cellwright.config.layout.arms import Arm, Tool
from cellwright.config.models.model import ModelShape
from cellwright.config.robot.collision_shapes import CollisionShapes
from cellwright.config.robot.given_drives import GivenDrive
from cellwright.config.robot.model import (
    Inertial,
    Joint,
    JointType,
    Limits,
    Link,
    RobotModel,
    link_poses,
    parent_T_child,
)
from cellwright.config.ur10 import GRIPPER, INITIAL_POSITIONS, UR10
from cellwright.util.pose import Pose

RAIL, RAIL_JOINT = "rail", "rail_joint"
"""Link of the beam of a rail, and the joint along it, with the prefix of the arm."""

FACE_DEPTH = 0.005
"""Depth of the cup's face below the origin of its link, along its -z [m]."""

_BEAM = (0.2, 0.1)
"""Width and height of a rail's beam [m]."""
_OVERHANG = 0.2
"""Length of the beam beyond the ends of the way [m]."""
_ROD, _CUP_HEIGHT = 0.02, 0.01
"""Radius of the rod that carries the cup, and height of the cup [m]."""
_CARRIAGE = Inertial(10.0, inertia=(0.1, 0.1, 0.1, 0.0, 0.0, 0.0))
_CUP = Inertial(0.01, inertia=(7e-6, 7e-6, 1.25e-5, 0.0, 0.0, 0.0))


@dataclass(frozen=True)
class ArmModel:
    """Model of an arm: what its file describes, with the limits of its entry.

    Attributes:
        robot: links and joints.
        mount_T_root: pose of its root link on its mount.
        collision: shapes that its links touch with.
        drives: drives that its file gives its joints, by joint; empty if they are stiff ones, by their inertia.
    """

    robot: RobotModel
    mount_T_root: Pose
    collision: CollisionShapes
    drives: Mapping[str, GivenDrive] = field(default_factory=dict)


def arm_model(arm: Arm, model: ArmModel, prefix: str) -> RobotModel:
    """Return an arm with its mount and its tool.

    Joints that are not between the root and the tip stand still, at home. Joints are in the order of the chain, and
    those of fingers come last.

    Args:
        arm: the arm.
        model: its model.
        prefix: prefix of all names.
    """
    robot = model.robot
    chain = {joint.name for joint in robot.chain(arm.tip)}
    still = tuple(joint if joint.name in chain else _still(joint, arm) for joint in robot.joints)
    named = replace(robot, joints=still).prefixed(prefix)
    root = named.root
    base, mount_links, mount_joints = _rail(arm, prefix) if arm.mount.kind == "rail" else _base(prefix)
    links = {**mount_links, **named.links}
    carrier, name = [*mount_links][-1], f"{prefix}mount_joint"
    fixed = Joint(name, JointType.FIXED, carrier, root, model.mount_T_root, (0.0, 0.0, 0.0))
    joints = [*mount_joints, fixed, *named.joints]
    if arm.tool.kind == "vacuum":
        tip_T_cup = Pose.from_rpy((0.0, 0.0, arm.tool.length - FACE_DEPTH), (math.pi, 0.0, 0.0))
        cup = f"{prefix}{GRIPPER}"
        links[cup] = Link(cup, _CUP, (_rod(arm.tool.length),))
        name = f"{prefix}vacuum_gripper_joint"
        joints.append(Joint(name, JointType.FIXED, f"{prefix}{arm.tip}", cup, tip_T_cup, (0.0, 0.0, 0.0)))
    if arm.tool.fingers is not None:
        names = GripperNames(prefix)
        made = gripper_links(arm.tool.fingers, names, f"{prefix}{arm.tip}", arm.tool.palm_distance)
        links, joints = links | made[0], joints + made[1]
    return RobotModel(robot.name, base, links, tuple(joints))


def bare_arm(arm: Arm, model: ArmModel, prefix: str) -> RobotModel:
    """Return an arm with its mount, without its tool; arguments as for `arm_model`."""
    return arm_model(replace(arm, tool=Tool("none")), model, prefix)


def laden(arm: Arm, arms: Sequence[Arm], models: Mapping[str, ArmModel]) -> RobotModel:
    """Return an arm by the names that it has in the engine, with the arms that stand on its links.

    Args:
        arm: the arm.
        arms: the arms of the cell.
        models: models of those that are not that of 2017, by name.
    """
    robot = chain_in_engine(arm, models)
    links, joints = dict(robot.links), [*robot.joints]
    for other in arms:
        if other.mount.on is not None and other.mount.on.arm == arm.name:
            carried, on = laden(other, arms, models), other.mount.on
            name = f"{carried.root}_joint"
            links |= carried.links
            joints.append(Joint(name, JointType.FIXED, on.body, carried.root, on.pose, (0.0, 0.0, 0.0)))
            joints += carried.joints
    return robot if len(joints) == len(robot.joints) else RobotModel(robot.name, robot.root, links, tuple(joints))


def is_on_robot(arm: Arm, arms: Sequence[Arm]) -> bool:
    """Return whether an arm of a cell stands on a robot, or on an arm that does."""
    on = arm.mount.on
    return on is not None and (bool(on.robot) or any(is_on_robot(each, arms) for each in arms if each.name == on.arm))


def mount_pose(
    arm: Arm,
    arms: Sequence[Arm],
    models: Mapping[str, ArmModel],
    positions: Mapping[str, Mapping[str, float]] | None = None,
    robots: Mapping[str, Mapping[str, Pose]] | None = None,
) -> Pose:
    """Return the frame of an arm's mount in the world, which the arms or the robot below it move.

    Args:
        arm: the arm.
        arms: the arms of the cell.
        models: models of those that are not that of 2017, by name.
        positions: positions of joints [rad; m] by their own names, by arm; by default, arms are at home.
        robots: poses of links in the world, by robot, as of `robot_links`; by default, robots are as a run begins.
    """
    on = arm.mount.on
    if on is None or (on.robot and not robots):
        return arm.pose
    if on.robot:
        return (robots or {})[on.robot][on.link] @ on.pose
    carrier = next(each for each in arms if each.name == on.arm)
    joints = (positions or {}).get(carrier.name) or home_of(carrier, joints_of(carrier, models))
    world_T_carrier = mount_pose(carrier, arms, models, positions, robots)
    return link_poses(bare_arm(carrier, models[carrier.name], ""), joints, world_T_carrier)[on.link] @ on.pose


def chain_in_engine(arm: Arm, models: Mapping[str, ArmModel]) -> RobotModel:
    """Return an arm with its mount and its tool, by the names that it has in the engine."""
    return UR10.prefixed(arm.prefix) if arm.is_original else arm_model(arm, models[arm.name], arm.prefix)


def links_by_frame(arms: Sequence[Arm], models: Mapping[str, ArmModel]) -> dict[str, str]:
    """Return the links of arms, as the engine names them, by their frames."""
    return {arm.frame_of(link): link for arm in arms for link in chain_in_engine(arm, models).links}


def moving_links(arm: Arm, models: Mapping[str, ArmModel]) -> list[str]:
    """Return the links that an arm's joints move, by their names in the engine; all if another arm carries it."""
    if arm.mount.on is not None:
        return [*chain_in_engine(arm, models).links]
    moving: list[str] = []
    for joint in chain_in_engine(arm, models).joints:
        if joint.is_driven or joint.parent in moving:
            moving.append(joint.child)
    return moving


def joints_of(arm: Arm, models: Mapping[str, ArmModel]) -> dict[str, Limits]:
    """Return the joints that an arm's controller moves with their limits, by their own names, base first."""
    return {joint.name: joint.limits for joint in driven_joints(arm, models)}


def driven_joints(arm: Arm, models: Mapping[str, ArmModel]) -> tuple[Joint, ...]:
    """Return the joints that an arm's controller moves, by their own names, base first."""
    return (UR10 if arm.is_original else bare_arm(arm, models[arm.name], "")).driven


def home_of(arm: Arm, joints: Mapping[str, Limits]) -> Mapping[str, float]:
    """Return the posture in which a run begins [rad; m], by joint: at 0, or the nearest limit, by default."""
    if arm.is_original:
        return {**INITIAL_POSITIONS, **arm.home}
    return {name: arm.home.get(name, min(max(0.0, each.lower), each.upper)) for name, each in joints.items()}


def _rod(length: float) -> ModelShape:
    """Return the rod between the tip and the cup, in the frame of the cup's link."""
    begin, end = _CUP_HEIGHT - FACE_DEPTH, length - FACE_DEPTH
    return ModelShape("cylinder", (_ROD, max(end - begin, 0.001), 0.0), Pose((0.0, 0.0, (begin + end) / 2)))


def _still(joint: Joint, arm: Arm) -> Joint:
    """Return a joint as a fixed one, at home."""
    if not joint.is_driven:
        return joint
    position = arm.home.get(joint.name, min(max(0.0, joint.limits.lower), joint.limits.upper))
    origin = parent_T_child(joint, position)
    return replace(joint, type=JointType.FIXED, origin=origin, axis=(0.0, 0.0, 0.0), limits=Limits(), mimic=None)


def _base(prefix: str) -> tuple[str, dict[str, Link], list[Joint]]:
    """Return the link of a mount that does not move."""
    name = f"{prefix}mount"
    return name, {name: Link(name)}, []


def _rail(arm: Arm, prefix: str) -> tuple[str, dict[str, Link], list[Joint]]:
    """Return the links of a rail, its beam and its carriage, and the joint between them."""
    mount, beam, carriage = arm.mount, f"{prefix}{RAIL}", f"{prefix}carriage"
    lower, upper = mount.range
    along = (1.0, 0.0, 0.0) if mount.axis == "x" else (0.0, 1.0, 0.0)
    middle, length = (lower + upper) / 2, upper - lower + 2 * _OVERHANG
    width, height = _BEAM
    size = (length, width, height) if mount.axis == "x" else (width, length, height)
    at = Pose((middle * along[0], middle * along[1], -0.1))
    links = {beam: Link(beam, shapes=(ModelShape("box", size, at),)), carriage: Link(carriage, _CARRIAGE)}
    limits = Limits(lower, upper, mount.effort, mount.speed)
    slide = Joint(f"{prefix}{RAIL_JOINT}", JointType.PRISMATIC, beam, carriage, Pose(), along, limits)
    return beam, links, [slide]
