"""Writes the beginning of a configuration file for a robot that has only a URDF."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

import yaml

from cellwright.config.robot.config import End, Gripper
from cellwright.config.robot.limbs import Limbs, find_limbs
from cellwright.config.robot.model import RobotModel
from cellwright.config.robot.posture import link_poses


def skeleton(robot: RobotModel, urdf: Path, folder: Path) -> str:
    """The text of a configuration file, with what is guessed said to be so.

    Args:
        robot: the robot.
        urdf: its file.
        folder: where the configuration is going to be, from which the URDF's path counts.
    """
    try:
        path = os.path.relpath(urdf, folder)
    except ValueError:  # on another drive of Windows there is no way from here to there
        path = str(urdf)
    return "\n".join([*_lines(robot, find_limbs(robot), path), ""])


def _lines(robot: RobotModel, limbs: Limbs, urdf_path: str) -> Iterator[str]:
    yield f"# How the robot {robot.name} is used. All groups are guessed from names and joints: go through them."
    yield "# Joints and links are given by name or by index; `cellwright robot` lists both. Units: m, rad."
    yield ""
    yield f"urdf_path: {_text(Path(urdf_path).as_posix())}"
    yield f"robot_name: {_text(robot.name)}"
    yield ""
    yield "# Where the root link stands, and how it is turned (x, y, z, w); raised so that no link's frame is below 0."
    yield f"base_pose: {{position: [0, 0, {_height(robot):g}], orientation: [0, 0, 0, 1]}}"
    yield ""
    yield "# Arms, the right one first. ee_index: the link at the tip. rest_j_pos: where the arm goes home."
    if not limbs.arms:
        yield "# None was found: no run of four or more joints. Take the marks away and name what there is."
        yield "# arms:"
        yield "#   - {joint_index: [joint_1, joint_2], ee_index: tool, rest_j_pos: [0, 0]}"
    else:
        yield "arms:"
    for arm in limbs.arms:
        yield f"  - joint_index: {_listed(arm.joints)}"
        yield f"    ee_index: {_text(arm.tip)}"
        yield f"    rest_j_pos: {_numbers(arm.home)}"
    yield ""
    yield "# Grippers, the right one first: open at the lower limits of these joints, closed at the upper ones;"
    yield "# with `open: upper` the other way round."
    yield "grippers:" if limbs.grippers else "# grippers:\n#   - joint_index: [finger_1, finger_2]"
    for gripper, is_end_known in zip(limbs.grippers, limbs.is_end_known, strict=True):
        yield f"  - joint_index: {_listed(gripper.joints)}"
        yield from _opening(gripper, is_known=is_end_known)
    yield ""
    yield "# The head's roll, pitch and yaw; -1 for what it lacks."
    head = ", ".join("-1" if name is None else _text(name) for name in limbs.head)
    mark = "" if any(limbs.head) else "# "
    yield f"{mark}head: {{joint_index: [{head}], rest_j_pos: [0, 0, 0]}}"
    for name, group in (("waist", limbs.waist), ("dorsal", limbs.lift)):
        if group is not None:
            yield ""
            yield "# What turns the torso." if name == "waist" else "# What lifts the torso."
            yield f"{name}: {{joint_index: {_listed(group.joints)}, rest_j_pos: {_numbers(group.home)}}}"
    if limbs.arms:
        yield ""
        yield "# Poses as targets: the link of each arm that they move, and the frame they are given in (-1: the root)."
        tips = _listed(arm.tip for arm in limbs.arms)
        yield f"controller_indices: {{cmd_ee: {tips}, base: {_numbers([-1] * len(limbs.arms))}}}"


def _opening(gripper: Gripper, *, is_known: bool) -> Iterator[str]:
    """The entry `open` of a gripper, or why there is none."""
    ends = set(gripper.open_ends)
    if not is_known:
        yield "    # Not known which end is open: move it, and write `open: upper` here if status 0 closes it."
    elif ends == {End.UPPER}:
        yield "    open: upper   # guessed: at the upper limits its fingers are farther apart"
    elif End.UPPER in ends:
        yield f"    open: [{', '.join(gripper.open_ends)}]   # guessed: there its fingers are farther apart"


def _height(robot: RobotModel) -> float:
    """How far the root has to be raised [m] for no link's frame to lie below the floor."""
    return round(max(0.0, *(-pose.position[2] for pose in link_poses(robot, {}).values()), 0.0), 3)


def _text(name: str) -> str:
    """A name as YAML, in quotes where it would be read as something else."""
    return str(yaml.safe_dump([name], default_flow_style=True, allow_unicode=True, width=10_000)).strip()[1:-1]


def _listed(names: Iterable[str]) -> str:
    return f"[{', '.join(map(_text, names))}]"


def _numbers(values: Iterable[float]) -> str:
    return f"[{', '.join(map(_number, values))}]"


def _number(value: float) -> str:
    """A number, exactly."""
    return f"{value:g}" if float(f"{value:g}") == value else repr(value)
