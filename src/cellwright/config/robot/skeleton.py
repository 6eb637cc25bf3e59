"""Draft of a configuration file for a robot that has only a URDF, with guessed groups."""

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

import yaml

from cellwright.config.robot.config import GripperConfig, RangeEnd
from cellwright.config.robot.limbs import Limbs, find_limbs
from cellwright.config.robot.model import RobotModel, link_poses
from cellwright.config.robot.urdf_file import NO_ARGUMENTS, Arguments


def skeleton(robot: RobotModel, urdf: Path, folder: Path, arguments: Arguments = NO_ARGUMENTS) -> str:
    """Return the text of a configuration file in a folder, which the URDF's path is relative to; guesses are marked.

    `arguments` are those of the xacro file, by name.
    """
    try:
        path = os.path.relpath(urdf, folder)
    except ValueError:  # on another Windows drive there is no relative path
        path = str(urdf)
    return "\n".join([*_lines(robot, find_limbs(robot), path, arguments), ""])


def _lines(robot: RobotModel, limbs: Limbs, urdf_path: str, arguments: Arguments) -> Iterator[str]:
    yield f"# Configuration of the robot {robot.name}. All groups are guesses from names and joints: check them."
    yield "# Write joints and links by name or by index; `cellwright robot` lists both. Units: m, rad."
    yield ""
    yield f"urdf_path: {_yaml_name(Path(urdf_path).as_posix())}"
    if arguments:
        given = ", ".join(f"{_yaml_name(name)}: {_yaml_name(value)}" for name, value in arguments.items())
        yield f"xacro_arguments: {{{given}}}"
    yield f"robot_name: {_yaml_name(robot.name)}"
    yield ""
    yield "# Pose of the root link, with orientation x, y, z, w; raised so that no link's frame is below 0."
    yield f"base_pose: {{position: [0, 0, {_height(robot):g}], orientation: [0, 0, 0, 1]}}"
    yield ""
    yield "# Arms, the right one first. ee_index: the link at the tip. rest_j_pos: home position of each joint."
    if not limbs.arms:
        yield "# No arm was found, since no chain has four or more joints. Uncomment these lines and adapt them."
        yield "# arms:"
        yield "#   - {joint_index: [joint_1, joint_2], ee_index: tool, rest_j_pos: [0, 0]}"
    else:
        yield "arms:"
    for arm in limbs.arms:
        yield f"  - joint_index: {_yaml_list(arm.joints)}"
        yield f"    ee_index: {_yaml_name(arm.tip)}"
        yield f"    rest_j_pos: {_yaml_numbers(arm.home)}"
    yield ""
    yield "# Grippers, the right one first: open at the lower limits of these joints, closed at the upper ones."
    yield "# `open: upper` reverses this."
    yield "grippers:" if limbs.grippers else "# grippers:\n#   - joint_index: [finger_1, finger_2]"
    for gripper, is_end_known in zip(limbs.grippers, limbs.is_end_known, strict=True):
        yield f"  - joint_index: {_yaml_list(gripper.joints)}"
        yield from _open_entry(gripper, is_known=is_end_known)
    yield ""
    yield "# Joints for the head's roll, pitch and yaw; -1 for a missing one."
    head = ", ".join("-1" if name is None else _yaml_name(name) for name in limbs.head)
    mark = "" if any(limbs.head) else "# "
    yield f"{mark}head: {{joint_index: [{head}], rest_j_pos: [0, 0, 0]}}"
    for name, group in (("waist", limbs.waist), ("dorsal", limbs.lift)):
        if group is not None:
            yield ""
            yield "# Joints that turn the torso." if name == "waist" else "# Joint that lifts the torso."
            yield f"{name}: {{joint_index: {_yaml_list(group.joints)}, rest_j_pos: {_yaml_numbers(group.home)}}}"
    if limbs.arms:
        yield ""
        yield "# Pose targets: the link of each arm that they move, and the link of their frame (-1: the root)."
        tips = _yaml_list(arm.tip for arm in limbs.arms)
        yield f"controller_indices: {{cmd_ee: {tips}, base: {_yaml_numbers([-1] * len(limbs.arms))}}}"


def _open_entry(gripper: GripperConfig, *, is_known: bool) -> Iterator[str]:
    """Yield the entry `open` of a gripper, or a comment on its absence."""
    ends = set(gripper.open_ends)
    if not is_known:
        yield "    # The open end is unknown: move the gripper, and write `open: upper` here if status 0 closes it."
    elif ends == {RangeEnd.UPPER}:
        yield "    open: upper   # guessed: at the upper limits its fingers are farther apart"
    elif RangeEnd.UPPER in ends:
        yield f"    open: [{', '.join(gripper.open_ends)}]   # guessed: there its fingers are farther apart"


def _height(robot: RobotModel) -> float:
    """Return the height [m] to raise the root by, so that no link's frame lies below the floor."""
    return round(max(0.0, *(-pose.position[2] for pose in link_poses(robot, {}).values()), 0.0), 3)


def _yaml_name(name: str) -> str:
    """Return a name as YAML, in quotes if YAML would read it as something else."""
    return str(yaml.safe_dump([name], default_flow_style=True, allow_unicode=True, width=10_000)).strip()[1:-1]


def _yaml_list(names: Iterable[str]) -> str:
    return f"[{', '.join(map(_yaml_name, names))}]"


def _yaml_numbers(values: Iterable[float]) -> str:
    return f"[{', '.join(map(_exact_number, values))}]"


def _exact_number(value: float) -> str:
    """Format a number exactly."""
    return f"{value:g}" if float(f"{value:g}") == value else repr(value)
