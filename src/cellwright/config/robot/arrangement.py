"""Checks of a robot configuration as a whole: do the groups make sense on this robot?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from cellwright.config.parsing.problems import Problems
from cellwright.config.parsing.tree import Items, Node, Table
from cellwright.config.robot.config import Arm, RobotConfig
from cellwright.config.robot.model import Joint, RobotModel
from cellwright.config.robot.references import listed, numbered
from cellwright.config.robot.sides import mixed_sides


def groups(config: RobotConfig) -> Iterator[tuple[str, tuple[str, ...], tuple[float, ...] | None]]:
    """Each group as (its key in the file, its joints, their home [rad; m]); grippers have no home of their own."""
    for number, arm in enumerate(config.arms):
        yield f"arms[{number}]", arm.joints, arm.home
    for number, gripper in enumerate(config.grippers):
        yield f"grippers[{number}]", gripper.joints, None
    for name in ("head", "waist", "dorsal"):
        group = getattr(config, name)
        if group is not None:
            yield name, group.joints, group.home


def check_shared(root: Table, config: RobotConfig, problems: Problems) -> None:
    """Report joints that are in two groups: they cannot go home to two places."""
    first: dict[str, str] = {}
    homes: dict[str, float] = {}
    for key, joints, home in groups(config):
        for name, position in zip(joints, home or _open(config, key, joints), strict=True):
            if name not in first:
                first[name], homes[name] = key, position
            elif homes[name] != position:
                problems.error(
                    _node(root, key),
                    f"{name} is in {first[name]} as well, and goes home to {homes[name]:g} there, to {position:g} here",
                )
            else:
                problems.warn(_node(root, key), f"{name} is in {first[name]} as well: what comes last is done")


def _open(config: RobotConfig, key: str, joints: Sequence[str]) -> tuple[float, ...]:
    """Where the joints of a gripper are open [rad; m]."""
    gripper = config.grippers[int(key[len("grippers[") : -1])]
    return tuple(gripper.way(config.robot.joint(name))[0] for name in joints)


def check_sides(root: Table, config: RobotConfig, problems: Problems) -> None:
    """Warn of arms and grippers that have joints of both sides of the robot."""
    robot = config.robot
    for key, joints, _ in groups(config):
        why = mixed_sides(robot, [robot.joint(name) for name in joints])
        if why and key.startswith(("arms", "grippers")):
            problems.warn(_node(root, key), f"mixes right and left: {why}; make a group of each side")


def check_arms(
    arms: Sequence[tuple[Node, Arm]], config: RobotConfig, joints: Sequence[Joint], problems: Problems
) -> None:
    """Warn of arms whose joints do not move their tips: a sign of indices that were counted otherwise.

    Args:
        arms: each with its place in the file.
        config: what the file comes to.
        joints: of the robot, as the file counts them.
        problems: takes the warnings.
    """
    robot = config.robot
    for number, (node, arm) in enumerate(arms):
        between = movers(robot, arm.tip, config.fixed_link)
        idle = [name for name in arm.joints if name not in between]
        if idle:
            hint = _other_order(robot, arm, joints, config.fixed_link)
            problems.warn(node, f"{listed(idle)}: does not move the tip {arm.tip}{hint}")
        commanded = config.command_links[number]
        if commanded != arm.tip and not set(arm.joints) & movers(robot, commanded, config.fixed_link):
            problems.warn(node, f"controller_indices.cmd_ee has {commanded} for this arm, which does not move it")


def movers(robot: RobotModel, link: str, fixed_link: str | None) -> set[str]:
    """The names of the joints that move a link against the one that is fastened to the world."""
    held = robot.chain(fixed_link) if fixed_link else ()
    return {joint.name for joint in robot.chain(link)} ^ {joint.name for joint in held}


def _other_order(robot: RobotModel, arm: Arm, joints: Sequence[Joint], fixed_link: str | None) -> str:
    """A remark when the same indices, counted in the other way, would make an arm that moves its tip."""
    other = "pybullet" if tuple(joints) != robot.joints else "urdf"
    again = numbered(robot, other)
    place = {joint.name: index for index, joint in enumerate(joints)}
    above = robot.joint_above(arm.tip)
    if again == tuple(joints) or above is None:
        return ""
    tip = again[place[above.name]].child
    if {again[place[name]].name for name in arm.joints} <= movers(robot, tip, fixed_link):
        return f"; with `joint_index_order: {other}` the same indices are an arm that moves its tip, {tip}"
    return ""


def _node(root: Table, key: str) -> Node:
    """What stands under a key such as `arms[0]` or `head`."""
    name, _, number = key.rstrip("]").partition("[")
    if name == "waist" and name not in root:
        name = "folding_waist"
    node = root.get(name)
    if number and isinstance(node, Items):
        return node.items[int(number)]
    return node if node is not None else root
