"""Tests of `cellwright ros2-env`: lines for a shell, and notes beside them."""

import os
import subprocess
from pathlib import Path

import pytest

from cellwright.cli import ros2
from cellwright.middleware.ros2.host.installation import PYTHON_VARIABLE, Installation
from tests.cli.conftest import CommandLine
from tests.support.waiting import TIMEOUT


@pytest.fixture
def installation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Installation:
    """An installation that sets a variable, drops another, and is not first on the path."""
    python = tmp_path / "bin" / "python3"
    python.parent.mkdir()
    python.write_text('#!/bin/sh\necho "$0 $ADDED ${DROPPED-gone}"\n')
    python.chmod(0o755)
    monkeypatch.setenv("DROPPED", "here")

    def find() -> Installation:
        environment = {name: value for name, value in os.environ.items() if name != "DROPPED"} | {"ADDED": "it's"}
        return Installation(str(python), environment, "jazzy")

    monkeypatch.setattr(ros2, "find", find)
    return find()


def test_evaluated_output_makes_python3_that_of_ros(cellwright: CommandLine, installation: Installation) -> None:
    ran = cellwright("ros2-env")
    assert (ran.status, ran.err) == (0, "")
    assert sorted(line.partition("=")[0] for line in ran.out.splitlines()) == [
        "export ADDED",
        "export PATH",
        "unset DROPPED",
    ]
    shell = ["bash", "-c", 'eval "$1"; python3', "bash", ran.out]
    said = subprocess.run(shell, capture_output=True, text=True, timeout=TIMEOUT, check=True).stdout
    assert said == f"{installation.python} it's gone\n"


def test_shell_that_is_ready_gets_no_lines(
    cellwright: CommandLine, installation: Installation, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("DROPPED")
    monkeypatch.setenv("ADDED", "it's")
    monkeypatch.setenv("PATH", f"{os.path.dirname(installation.python)}:/bin")
    monkeypatch.setattr(ros2, "find", lambda: Installation(installation.python, dict(os.environ), "jazzy"))
    assert cellwright("ros2-env").out == ""


def test_missing_interfaces_and_notes_go_to_stderr(cellwright: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    found = Installation("/usr/bin/python3", {}, "humble", ("osrf_gear", "tf2_msgs"), ("something is ignored",))
    monkeypatch.setattr(ros2, "find", lambda: found)
    ran = cellwright("ros2-env", "--shell", "fish")
    assert ran.status == 0
    assert "set -gx PATH '/usr/bin'" in ran.out
    first, second = ran.err.splitlines()
    assert first == "note: something is ignored"
    assert second.startswith("note: /usr/bin/python3 lacks osrf_gear, tf2_msgs; run: cellwright ros2-workspace DIR")


def test_unknown_shell_and_missing_ros_are_refused(cellwright: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    ran = cellwright("ros2-env", "--shell", "tcsh")
    assert (ran.status, ran.err) == (2, "error: --shell tcsh: give one of sh, fish\n")
    monkeypatch.setenv(PYTHON_VARIABLE, "/nowhere/python3")
    ran = cellwright("ros2-env")
    assert ran.status == 2
    assert ran.err.startswith(f"error: {PYTHON_VARIABLE} is /nowhere/python3, which has no rclpy; ")
    assert len(ran.err.splitlines()) == 1


@pytest.mark.ros2
def test_evaluated_output_gives_shell_the_real_ros(cellwright: CommandLine) -> None:
    lines = cellwright("ros2-env").out
    program = "import rclpy; from osrf_gear.msg import Order; print(Order().order_id == '')"
    shell = ["bash", "-c", 'eval "$1"; python3 -c "$2"', "bash", lines, program]
    ran = subprocess.run(shell, capture_output=True, text=True, timeout=TIMEOUT, check=False)
    assert (ran.stdout, ran.stderr) == ("True\n", "")
