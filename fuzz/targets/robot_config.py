"""Robot configurations, `vr_configs.yml`, changed as trees: a node is built from the rest, or they are refused."""

from __future__ import annotations

import json
import random
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from cellwright.config.robot.groups import robot_document
from cellwright.config.robot.robots import load_robot
from cellwright.robot.node import RobotNode
from cellwright.util.errors import DescriptionError
from fuzz import seeds as bundled
from fuzz import yaml_trees
from fuzz.verdict import check_lines, check_refusal

MAX_SIZE = 8000
WORDS = (
    *(
        "urdf_path",
        "robot_name",
        "base_pose",
        "position",
        "orientation",
        "arms",
        "joint_index",
        "ee_index",
        "rest_j_pos",
    ),
    *("grippers", "head", "waist", "dorsal", "controller_indices", "cmd_ee", "base", "fixed_link", "wo_controller"),
    *("cameras", "joint_order", "pybullet", "without_gui", "-1", "left_arm_joint_1", "tandem"),
    *("open", "upper", "lower", "max_acceleration"),
)
_CATALOGUE = bundled.ROOT / "src/cellwright/config/robot/catalogue/tandem"
_FOLDER = Path(tempfile.mkdtemp(prefix="cellwright-fuzz-"))
shutil.copytree(_CATALOGUE / "urdf", _FOLDER / "urdf")
_PATH = _FOLDER / "vr_configs.yml"


def seeds() -> Iterator[bytes]:
    """Yield the bundled configurations."""
    yield from bundled.files("src/cellwright/config/robot/catalogue/tandem/vr_configs.yml")


def mutate(data: bytes, chance: random.Random) -> bytes | None:
    """Return another configuration."""
    return yaml_trees.mutate(data, chance, WORDS)


def attempt(data: bytes) -> None:
    """Load the configuration, describe it, and step a node of it."""
    _PATH.write_bytes(data)
    warnings: list[str] = []
    try:
        config = load_robot(_PATH, warnings.append)
    except DescriptionError as error:
        check_refusal(error, str(_PATH), str(config_urdf()))
        return
    check_lines(warnings, [str(_PATH), str(config.urdf_path), str(config_urdf())])
    json.dumps(robot_document(config), allow_nan=False)
    try:
        node = RobotNode(config)
    except DescriptionError as error:
        check_refusal(error, str(_PATH), str(config.urdf_path))
        return
    for _ in range(3):
        node.simulation.step()
    node.close()


def config_urdf() -> Path:
    """Return the robot that an unchanged configuration names."""
    return _FOLDER / "urdf" / "tandem.urdf"
