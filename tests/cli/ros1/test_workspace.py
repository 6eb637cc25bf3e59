"""Tests of `cellwright ros1-workspace`: its files, and its requirements. tests/ros1/test_catkin.py builds it."""

from pathlib import Path

import pytest

from cellwright.cli import ros1 as ros1_workspace
from cellwright.middleware.ros1.host.installation import RosSystem
from tests.cli.conftest import CommandLine
from tests.ros1.fake_system import fake_system

__all__ = ["fake_system"]


@pytest.fixture(autouse=True)
def system(fake_system: RosSystem, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ros1_workspace, "find_system", lambda: fake_system)


def test_no_build_writes_sources_only(cellwright: CommandLine, tmp_path: Path) -> None:
    ran = cellwright("ros1-workspace", "ws", "--no-build")
    assert (ran.status, ran.out, ran.err) == (0, "laid out ws/src/ariac\n", "")
    assert (tmp_path / "ws" / "src" / "ariac" / "osrf_gear" / "msg" / "Order.msg").is_file()
    assert not (tmp_path / "ws" / "build").exists()


def test_missing_build_tools_are_reported_before_writing(cellwright: CommandLine, tmp_path: Path) -> None:
    ran = cellwright("ros1-workspace", "ws")
    assert ran.status == 2
    assert ran.err.startswith("error: catkin cannot build: actionlib_msgs, catkin, ")
    assert "apt-get install catkin " in ran.err
    assert len(ran.err.splitlines()) == 1
    assert not (tmp_path / "ws").exists()


def test_file_as_workspace_is_refused(cellwright: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "ws").touch()
    ran = cellwright("ros1-workspace", "ws", "--no-build")
    assert (ran.status, ran.err) == (2, "error: ws: is not a folder\n")


def test_failed_build_prints_output(
    cellwright: CommandLine, fake_system: RosSystem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cellwright.middleware.ros1.packages.workspace.missing", lambda _ros: [])
    make = tmp_path / "bin" / "catkin_make"
    make.parent.mkdir()
    make.write_text("#!/bin/sh\npwd\necho it does not work >&2\nexit 3\n")
    make.chmod(0o755)
    monkeypatch.setenv("PATH", f"{make.parent}:/usr/bin:/bin")
    ran = cellwright("ros1-workspace", "ws")
    assert ran.status == 2
    assert ran.out == "laid out ws/src/ariac\n"
    assert ran.err.splitlines() == ["error: catkin_make failed:", f"error: {tmp_path}/ws", "error: it does not work"]
