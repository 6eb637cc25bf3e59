"""Colcon workspace: written, updated, and built with a stand-in for colcon."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.middleware.ros2.packages.contents import interface_packages, package_files
from cellwright.middleware.ros2.packages.workspace import build, lay_out
from cellwright.util.errors import UsageError


def test_lay_out_writes_all_packages(tmp_path: Path) -> None:
    assert lay_out(tmp_path / "ws", {}) == {}
    source = tmp_path / "ws" / "src"
    assert sorted(path.name for path in source.iterdir()) == sorted(["cellwright", *interface_packages()])
    for package in source.iterdir():
        there = {
            path.relative_to(package).as_posix(): path.read_bytes() for path in package.rglob("*") if path.is_file()
        }
        assert there == package_files(package.name)


def test_lay_out_leaves_other_sources_and_unchanged_files(tmp_path: Path) -> None:
    own = tmp_path / "src" / "my_robot" / "package.xml"
    own.parent.mkdir(parents=True)
    own.write_text("mine")
    lay_out(tmp_path, {})
    manifest = tmp_path / "src" / "osrf_gear" / "package.xml"
    before = manifest.stat().st_mtime_ns
    (tmp_path / "src" / "osrf_gear" / "CMakeLists.txt").write_text("changed")
    lay_out(tmp_path, {})
    assert own.read_text() == "mine"
    assert manifest.stat().st_mtime_ns == before
    assert [path.name for path in tmp_path.rglob("*~")] == ["CMakeLists.txt~"]


def test_packages_of_sourced_distribution_are_left_out(tmp_path: Path) -> None:
    ros, folder = tmp_path / "ros", tmp_path / "ws"
    installed = folder / "install" / "osrf_gear"
    for prefix, package in ((ros, "control_msgs"), (ros, "tf2_msgs"), (installed, "osrf_gear")):
        (prefix / "share" / package).mkdir(parents=True)
        (prefix / "share" / package / "package.xml").touch()
    left_out = lay_out(folder, {"AMENT_PREFIX_PATH": f"{installed}:{ros}"})
    assert left_out == {"control_msgs": ros, "tf2_msgs": ros}
    laid_out = {path.name for path in (folder / "src").iterdir()}
    assert laid_out == {"cellwright", *interface_packages()} - {"control_msgs", "tf2_msgs"}


@pytest.mark.parametrize(("distribution", "has_index"), [("jazzy", False), ("kilted", True), ("rolling", True)])
def test_definitions_are_those_of_sourced_distribution(tmp_path: Path, distribution: str, has_index: bool) -> None:
    lay_out(tmp_path, {"ROS_DISTRO": distribution})
    action = tmp_path / "src" / "control_msgs" / "action" / "FollowJointTrajectory.action"
    assert ("int32 index" in action.read_text()) == has_index


def test_lay_out_to_unwritable_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "src").touch()
    with pytest.raises(UsageError, match="cannot write a workspace: Not a directory"):
        lay_out(tmp_path, {})


@pytest.fixture
def colcon(tmp_path: Path) -> dict[str, str]:
    """Return a shell with a distribution, and with a colcon that fails if there is a folder `bad`."""
    program = tmp_path / "bin" / "colcon"
    program.parent.mkdir()
    program.write_text(
        '#!/bin/sh\n[ "$1" = build ] || exit 9\npwd\nif [ -d bad ]; then echo wrong >&2; exit 3; fi\nmkdir install\n'
    )
    program.chmod(0o755)
    return {"PATH": f"{program.parent}:/usr/bin:/bin", "AMENT_PREFIX_PATH": "/opt/ros/jazzy"}


def test_build_runs_colcon_in_workspace(tmp_path: Path, colcon: dict[str, str]) -> None:
    lay_out(tmp_path / "ws", colcon)
    build(tmp_path / "ws", colcon)
    assert (tmp_path / "ws" / "install").is_dir()


def test_failed_build_shows_output_of_colcon(tmp_path: Path, colcon: dict[str, str]) -> None:
    (tmp_path / "ws" / "bad").mkdir(parents=True)
    with pytest.raises(UsageError) as caught:
        build(tmp_path / "ws", colcon)
    assert str(caught.value).splitlines() == ["colcon build failed:", str(tmp_path / "ws"), "wrong"]


def test_build_without_colcon_or_distribution_is_refused(tmp_path: Path, colcon: dict[str, str]) -> None:
    with pytest.raises(UsageError, match=r"colcon: no such program; run: apt-get install python3-colcon-common-ext"):
        build(tmp_path, {"PATH": "/nowhere", "AMENT_PREFIX_PATH": "/opt/ros/jazzy"})
    with pytest.raises(UsageError, match="AMENT_PREFIX_PATH is not set; source a ROS 2 distribution first"):
        build(tmp_path, {"PATH": colcon["PATH"]})
