"""Page on robot configurations: its example is valid. Its tables: `tests/tools/test_configuration_pages.py`."""

import re
import shutil
from pathlib import Path

import pytest
import yaml

from cellwright.config.robot.config import UNUSED, RobotConfig
from cellwright.config.robot.robots import ENTRIES, bundled, find_robot, load_robot, read_robot_config

PAGE = (Path(__file__).parents[3] / "docs" / "robot-configuration.md").read_text()


def refuse(line: str) -> None:
    raise AssertionError(line)


@pytest.fixture
def example(tmp_path: Path) -> RobotConfig:
    (text,) = re.findall(r"```yaml\n(.*?)```", PAGE, re.DOTALL)
    shutil.copytree(find_robot("tandem").parent, tmp_path, dirs_exist_ok=True)
    path = tmp_path / "vr_configs.yml"
    path.write_text(text)
    return read_robot_config(path, refuse)


def test_page_example_equals_bundled_tandem(example: RobotConfig) -> None:
    tandem = load_robot("tandem", refuse)
    for name in ("arms", "head", "dorsal", "base_pose", "command_links", "reference_links", "start"):
        assert getattr(example, name) == getattr(tandem, name)
    assert [gripper.joints[0] for gripper in example.grippers] == ["right_gripper", "left_gripper"]


def test_bundled_configurations_have_only_known_entries() -> None:
    for name in bundled():
        entries = yaml.safe_load(find_robot(name).read_text())
        assert set(entries) <= {*ENTRIES.names, *UNUSED}
