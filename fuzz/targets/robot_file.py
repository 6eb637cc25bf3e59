"""URDF files, changed as trees and as text: forgiven, replaced or refused; the rest can be built and simulated."""

from __future__ import annotations

import random
import tempfile
from collections.abc import Iterator
from pathlib import Path

import mujoco

from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.description import description
from cellwright.config.robot.model import link_poses
from cellwright.config.robot.skeleton import skeleton
from cellwright.config.robot.urdf import read_urdf
from cellwright.config.robot.urdf_file import read_text
from cellwright.robot.model import build_robot
from cellwright.util.errors import DescriptionError
from fuzz import seeds as bundled
from fuzz import xml_trees
from fuzz.verdict import FindingError, check_lines, check_refusal

MAX_SIZE = 30_000
TAGS = (
    *("robot", "link", "joint", "material", "color", "inertial", "mass", "inertia", "origin", "visual", "collision"),
    *("geometry", "box", "cylinder", "capsule", "sphere", "mesh", "parent", "child", "axis", "limit", "mimic"),
)
NAMES = (
    *(
        "name",
        "type",
        "xyz",
        "rpy",
        "value",
        "ixx",
        "iyy",
        "izz",
        "ixy",
        "size",
        "radius",
        "length",
        "filename",
        "scale",
    ),
    *("link", "joint", "multiplier", "offset", "lower", "upper", "effort", "velocity", "rgba"),
)
WORDS = (
    *TAGS,
    *NAMES,
    "revolute",
    "continuous",
    "prismatic",
    "fixed",
    "floating",
    "planar",
    "spherical",
    "<!DOCTYPE a [",
)
_PATH = Path(tempfile.mkdtemp(prefix="cellwright-fuzz-")) / "robot.urdf"


def seeds() -> Iterator[bytes]:
    """Yield the bundled robots, and a small one with every kind of joint."""
    yield from bundled.files("docs/examples/**/*.urdf", "src/cellwright/description/robot/catalogue/**/tandem.urdf")
    joints = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar", "spherical")
    yield (
        '<robot name="r"><material name="m"><color rgba="1 0 0 1"/></material><link name="l0"/>'
        + "".join(
            f'<link name="l{k}"><inertial><origin xyz="0 0 1" rpy="1 2 3"/><mass value="2"/><inertia ixx="1" iyy="1" '
            f'izz="1" ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry><sphere radius="1"/></geometry>'
            f'</collision><visual><geometry><mesh filename="a.stl" scale="1 1 1"/></geometry></visual></link>'
            f'<joint name="j{k}" type="{kind}"><origin xyz="1 2 3" rpy="0 0 1"/><parent link="l{k - 1}"/>'
            f'<child link="l{k}"/><axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="9" velocity="2"/>'
            + ('<mimic joint="j1" multiplier="2" offset="1"/></joint>' if k == 3 else "</joint>")
            for k, kind in enumerate(joints, start=1)
        )
        + "</robot>"
    ).encode()


def mutate(data: bytes, chance: random.Random) -> bytes | None:
    """Return another robot."""
    return xml_trees.mutate(data, chance, TAGS, NAMES)


def attempt(data: bytes) -> None:
    """Read the robot, propose a configuration for it, describe it, build it, and simulate it for a while."""
    _PATH.write_bytes(data)
    warnings: list[str] = []
    try:
        robot = read_urdf(_PATH, warn=warnings.append)
    except DescriptionError as error:
        check_refusal(error, str(_PATH))
        return
    check_lines(warnings, [str(_PATH)])
    poses = link_poses(robot, {joint.name: 1.0 for joint in robot.driven})
    if not all(pose.is_finite() for pose in poses.values()):
        raise FindingError("a link that is nowhere")
    skeleton(robot, _PATH, _PATH.parent)
    description(read_text(_PATH), robot, _PATH)
    try:
        world = build_robot(RobotConfig(robot, "robot", _PATH, _PATH))
    except DescriptionError as error:
        check_refusal(error, str(_PATH))
        return
    simulated = mujoco.MjData(world.model)
    world.set_initial_posture(simulated)
    for _ in range(5):
        mujoco.mj_step(world.model, simulated)
