"""Source files of a description, as a recording contains them."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.config.parsing.sources import read_at_most, sources_collected
from cellwright.config.robot.robots import load_robot
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from tests.config.robot import small_robot

XACRO = """<robot name="two" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:include filename="parts/link.xacro"/><xacro:a_link/></robot>"""
LINK = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:macro name="a_link"><link name="base"/></xacro:macro></robot>"""


def unpack(files: dict[str, bytes], folder: Path) -> None:
    """Write files to their paths in a recording."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)


def test_bundled_and_own_files_have_distinct_names(tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    own = tmp_path / "deep" / "own.yaml"
    own.write_text("time_limit: 5\n")
    with sources_collected() as sources:
        load_trial([find_trial("qual1a"), own])
    read_at_most(own, 100)  # outside of `sources_collected`
    assert sources.files() == {
        "bundled/config/trial/catalogue/qual1a.yaml": find_trial("qual1a").read_bytes(),
        "files/own.yaml": b"time_limit: 5\n",
    }
    assert sources.name(own) == "files/own.yaml"
    with pytest.raises(KeyError):
        sources.name(tmp_path / "other.yaml")


def test_collected_robot_loads_again_from_its_names(tmp_path: Path) -> None:
    (tmp_path / "robot").mkdir()
    path = small_robot.write(tmp_path / "robot")
    warnings: list[str] = []
    with sources_collected() as sources:
        first = load_robot(path, warnings.append)
    unpack(sources.files(), tmp_path / "back")
    again = load_robot(tmp_path / "back" / sources.name(path), warnings.append)
    assert again.robot == first.robot
    assert again.home == first.home


def test_xacro_includes_are_collected(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "two.xacro").write_text(XACRO)
    (tmp_path / "parts" / "link.xacro").write_text(LINK)
    with sources_collected() as sources:
        first = load_robot(tmp_path / "two.xacro", print)
    assert sorted(sources.files()) == ["files/parts/link.xacro", "files/two.xacro"]
    unpack(sources.files(), tmp_path / "back")
    assert load_robot(tmp_path / "back" / "files" / "two.xacro", print).robot == first.robot


def test_used_ros_package_folders_are_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    share, own = tmp_path / "share", tmp_path / "own.yaml"
    (share / "pack").mkdir(parents=True)
    (share / "pack" / "mesh.stl").write_bytes(b"mesh")
    own.write_text("")
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path / 'none'}:{share}:")
    with sources_collected() as sources:
        read_at_most(own, 10)
        assert sources.packages() == []
        read_at_most(share / "pack" / "mesh.stl", 10)
    assert sources.packages() == ["files/share"]


def test_folders_and_devices_are_not_collected(tmp_path: Path) -> None:
    with sources_collected() as sources:
        sources.add(tmp_path)
        sources.add(tmp_path / "none")
        sources.add(Path("/dev/zero"))
    assert sources.files() == {}
