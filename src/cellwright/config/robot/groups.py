"""Joint groups of a robot configuration: sides, consistency checks, and the robot as JSON values."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from itertools import takewhile
from typing import Any

from cellwright.config.parsing.tree import Items, Problems, Table, YamlNode
from cellwright.config.robot.config import UNUSED, ArmConfig, Posture, RangeEnd, RobotConfig
from cellwright.config.robot.group_reader import AXES_OF_HEAD, listed, numbered
from cellwright.config.robot.model import ROOT, Joint, JointType, Limits, RobotModel, link_poses
from cellwright.util.pose import Pose

MIN_NAMED_JOINTS, MIN_JOINTS = 2, 3
"""Minimum numbers of joints between a fork and a group that make the branch a limb rather than a finger, with and
without names that tell the sides: a single joint may spread a finger."""

_SIDE = re.compile(
    r"(?:^|[_\W])(?P<r>r(?:ight)?)(?=[_\W\d]|$)|(?:^|[_\W])(?P<l>l(?:eft)?)(?=[_\W\d]|$)|(?P<right>right)|(?P<left>left)",
    re.IGNORECASE,
)


def side_of(name: str) -> str:
    """Return the side that a name states first: "right", "left" or ""; `right_gripper_left_finger` is on the right."""
    match = _SIDE.search(name)
    if match is None:
        return ""
    return "right" if match["r"] or match["right"] else "left"


def mixed_sides(robot: RobotModel, joints: Sequence[Joint]) -> str:
    """Return the reason why a group of joints belongs to both sides of a robot; empty if it belongs to one.

    Two fingers of one palm may be called left and right. So names count only if a limb lies between the fork and the
    group, and without names it takes two such limbs.
    """
    chains = [robot.chain(joint.child) for joint in joints]
    shared_joints = takewhile(lambda each: all(joint is each[0] for joint in each), zip(*chains, strict=False))
    # number of joints that all paths from the root share at their start
    shared = sum(1 for _ in shared_joints)
    names = {joint.name for joint in joints}
    between: dict[str, int] = {}
    for chain in chains:
        own = chain[shared:]
        count = sum(joint.is_driven and joint.mimic is None and joint.name not in names for joint in own)
        if own:
            between[own[0].name] = max(count, between.get(own[0].name, 0))
    by_side = {side_of(joint.name): joint.name for joint in joints}
    if "right" in by_side and "left" in by_side and max(between.values(), default=0) >= MIN_NAMED_JOINTS:
        return f"{by_side['right']} is on the right, {by_side['left']} on the left"
    branches = [name for name, count in between.items() if count >= MIN_JOINTS]
    return f"its joints belong to two limbs, behind {branches[0]} and behind {branches[1]}" if len(branches) > 1 else ""


def groups(config: RobotConfig) -> Iterator[tuple[str, tuple[str, ...], tuple[float, ...]]]:
    """Yield each group as (its key in the file, its joints, their home [rad; m]); grippers go home open."""
    for number, arm in enumerate(config.arms):
        yield f"arms[{number}]", arm.joints, arm.home
    for number, gripper in enumerate(config.grippers):
        open_at = tuple(gripper.open_and_closed(config.robot.joint(name))[0] for name in gripper.joints)
        yield f"grippers[{number}]", gripper.joints, open_at
    for name, group in _single_groups(config):
        if group is not None:
            yield name, group.joints, group.home


def _single_groups(config: RobotConfig) -> tuple[tuple[str, Posture | None], ...]:
    """Return head, waist and lift, each with its key in the file; None for one that the robot lacks."""
    return ("head", config.head), ("waist", config.waist), ("dorsal", config.dorsal)


def check_shared(root: Table, config: RobotConfig, problems: Problems) -> None:
    """Report joints that are in two groups, since they cannot have two home positions."""
    first: dict[str, str] = {}
    homes: dict[str, float] = {}
    for key, joints, home in groups(config):
        for name, position in zip(joints, home, strict=True):
            if name not in first:
                first[name], homes[name] = key, position
            elif homes[name] != position:
                problems.error(
                    _node(root, key),
                    f"{name} must have one home position (got {homes[name]:g} in {first[name]}, {position:g} here)",
                )
            else:
                problems.warn(_node(root, key), f"{name} is in {first[name]} as well; its last command counts")


def check_sides(root: Table, config: RobotConfig, problems: Problems) -> None:
    """Warn of arms and grippers that have joints of both sides of the robot."""
    robot = config.robot
    for key, joints, _ in groups(config):
        reason = mixed_sides(robot, [robot.joint(name) for name in joints])
        if reason and key.startswith(("arms", "grippers")):
            problems.warn(_node(root, key), f"mixes right and left: {reason}; make a group of each side")


def check_arms(
    arms: Sequence[tuple[YamlNode, ArmConfig]], config: RobotConfig, joints: Sequence[Joint], problems: Problems
) -> None:
    """Warn of arms whose joints do not move their tips, a sign of indices in another order.

    Each arm has its node in the file; `joints` are the robot's joints in the file's order.
    """
    robot = config.robot
    for number, (node, arm) in enumerate(arms):
        between = moving_joints(robot, arm.tip, config.fixed_link)
        idle = [name for name in arm.joints if name not in between]
        if idle:
            hint = _other_order(robot, arm, joints, config.fixed_link)
            problems.warn(node, f"the tip {arm.tip} is not moved by {listed(idle)}{hint}")
        commanded = config.command_links[number]
        if commanded != arm.tip and not set(arm.joints) & moving_joints(robot, commanded, config.fixed_link):
            problems.warn(node, f"controller_indices.cmd_ee names {commanded}, which this arm does not move")


def moving_joints(robot: RobotModel, link: str, fixed_link: str | None) -> set[str]:
    """Return the names of the joints that move a link relative to the link that is fixed to the world."""
    held = robot.chain(fixed_link) if fixed_link else ()
    return {joint.name for joint in robot.chain(link)} ^ {joint.name for joint in held}


def _other_order(robot: RobotModel, arm: ArmConfig, joints: Sequence[Joint], fixed_link: str | None) -> str:
    """Return a hint if the same indices, in the other order, would make an arm that moves its tip."""
    other = "pybullet" if tuple(joints) != robot.joints else "urdf"
    renumbered = numbered(robot, other)
    place = {joint.name: index for index, joint in enumerate(joints)}
    above = robot.joint_above(arm.tip)
    if renumbered == tuple(joints) or above is None:
        return ""
    tip = renumbered[place[above.name]].child
    if {renumbered[place[name]].name for name in arm.joints} <= moving_joints(robot, tip, fixed_link):
        return f"; with `joint_index_order: {other}` the same indices move the tip {tip}"
    return ""


def _node(root: Table, key: str) -> YamlNode:
    """Return the node under a key such as `arms[0]` or `head`."""
    name, _, number = key.rstrip("]").partition("[")
    if name == "waist" and name not in root:
        name = "folding_waist"
    node = root.get(name)
    if number and isinstance(node, Items):
        return node.items[int(number)]
    return node if node is not None else root


def robot_document(config: RobotConfig, positions: Mapping[str, float] | None = None) -> dict[str, Any]:
    """Return a robot with its joints by index, its groups and links; joints are at `positions` [rad; m], or at 0."""
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
    """Return the index of the parent link of a joint; -1 for the root."""
    return config.robot.link_indices.get(joint.parent, ROOT)


def groups_of(config: RobotConfig, joint: Joint) -> list[str]:
    """Return the groups of a joint, by their keys in the file."""
    return [key for key, joints, _ in groups(config) if joint.name in joints]


def _joint(config: RobotConfig, joint: Joint) -> dict[str, Any]:
    is_fixed = joint.type is JointType.FIXED
    # as the original's engine reports joints without a motor
    limits = Limits(0.0, -1.0, 0.0, 0.0) if is_fixed else joint.limits
    return {
        "index": config.robot.joint_indices[joint.name],
        "name": joint.name,
        "type": str(joint.type),
        "link": joint.child,
        "parent": joint.parent,
        "parent_index": parent_index(config, joint),
        **{name: value if math.isfinite(value) else None for name, value in asdict(limits).items()},
        "axis": [0.0, 0.0, 0.0] if is_fixed else list(joint.axis),
        "mimic": asdict(joint.mimic) if joint.mimic else None,
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
            {"joints": list(gripper.joints), "open": list(gripper.open_ends) or [RangeEnd.LOWER] * len(gripper.joints)}
            for gripper in config.grippers
        ],
    }
    for name, group in _single_groups(config):
        found[name] = None if group is None else {"joints": list(group.joints), "home": list(group.home)}
    if config.head is not None:
        found["head"]["axes"] = [AXES_OF_HEAD[axis] for axis in config.head_axes]
    return found


def _pose(pose: Pose) -> list[list[float]]:
    """Return position [m] and quaternion (x, y, z, w), as in messages."""
    w, x, y, z = pose.quaternion
    return [list(pose.position), [x, y, z, w]]
