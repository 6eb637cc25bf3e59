"""Tests of the order of a robot's process."""

from pathlib import Path
from typing import Any

import pytest

from cellwright.running.remote.robot import configuration
from cellwright.util.errors import CellwrightError
from tests.clients.assembled.robots import configs, write_urdf


def test_configuration_of_order_gives_robot(tmp_path: Path) -> None:
    config = configuration({"urdf": str(write_urdf(tmp_path)), "configs": configs()})
    assert [arm.joints for arm in config.arms] == [("shoulder",)]
    assert config.urdf_path == tmp_path / "small.urdf"


@pytest.mark.parametrize(
    ("urdf", "given", "problem"),
    [
        ("none.urdf", configs(), r"none\.urdf"),
        ("small.urdf", ["arms"], "configs: must be a dictionary"),
        ("small.urdf", {**configs(), "dorsal": {"joint_index": 2}}, r"^configs: dorsal\.joint_index"),
        (
            "small.urdf",
            {**configs(), "base_pose": {"position": [0, 0, float("nan")]}},
            r"^configs: base_pose\.position",
        ),
    ],
)
def test_invalid_order_is_refused_with_place(tmp_path: Path, urdf: str, given: Any, problem: str) -> None:
    write_urdf(tmp_path)
    with pytest.raises(CellwrightError, match=problem):
        configuration({"urdf": str(tmp_path / urdf), "configs": given})


def test_warning_names_configuration_entry(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    configuration({"urdf": str(write_urdf(tmp_path)), "configs": {**configs(), "gripper": 1}})
    assert "robot: configs: gripper" in capsys.readouterr().err
