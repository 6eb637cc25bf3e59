"""Tests of `cellwright ros2-workspace`: its files, and what a build requires."""

from pathlib import Path

import pytest

from tests.cli.conftest import CommandLine


@pytest.fixture(autouse=True)
def bare_shell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    monkeypatch.setenv("PATH", f"{tmp_path}/bin:/usr/bin:/bin")


def test_sources_are_written_without_build(cellwright: CommandLine, tmp_path: Path) -> None:
    ran = cellwright("ros2-workspace", "ws")
    assert (ran.status, ran.out, ran.err) == (0, "laid out ws/src\n", "")
    assert (tmp_path / "ws" / "src" / "osrf_gear" / "msg" / "Order.msg").is_file()


def test_package_of_sourced_prefix_is_reported(
    cellwright: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "ros" / "share" / "tf2_msgs").mkdir(parents=True)
    (tmp_path / "ros" / "share" / "tf2_msgs" / "package.xml").touch()
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "ros"))
    ran = cellwright("ros2-workspace", "ws")
    assert ran.out == f"laid out ws/src\nleft out tf2_msgs: it is in {tmp_path / 'ros'}\n"


def test_missing_build_tool_is_reported_before_writing(
    cellwright: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    ran = cellwright("ros2-workspace", "ws", "--build")
    assert ran.status == 2
    assert ran.err.startswith("error: colcon: no such program; ")
    assert not (tmp_path / "ws").exists()


def test_build_with_colcon_names_next_step(
    cellwright: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / "bin" / "colcon"
    program.parent.mkdir()
    program.write_text("#!/bin/sh\n[ ! -d src/bad ]\n")
    program.chmod(0o755)
    monkeypatch.setenv("AMENT_PREFIX_PATH", "/opt/ros/jazzy")
    ran = cellwright("ros2-workspace", "ws", "--build")
    assert ran.status == 0
    assert ran.out.splitlines()[-1] == "next: source ws/install/setup.bash"
    (tmp_path / "ws" / "src" / "bad").mkdir()
    ran = cellwright("ros2-workspace", "ws", "--build")
    assert (ran.status, ran.err) == (2, "error: colcon build failed:\n")


def test_file_as_workspace_is_refused(cellwright: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "ws").touch()
    ran = cellwright("ros2-workspace", "ws")
    assert (ran.status, ran.err) == (2, "error: ws: is not a folder\n")
