"""Tests of `cellwright ros1-env`: lines for a shell, or one line with the error."""

import subprocess
from pathlib import Path

import pytest

from cellwright.cli import ros1 as ros1_env
from cellwright.middleware.ros1.host.installation import RosSystem
from tests.cli.conftest import CommandLine
from tests.ros1.fake_system import fake_system
from tests.support.waiting import TIMEOUT

__all__ = ["fake_system"]


@pytest.fixture(autouse=True)
def at_home(fake_system: RosSystem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ros1_env, "find_system", lambda: fake_system)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def test_evaluated_output_sets_paths_in_bash(cellwright: CommandLine) -> None:
    ran = cellwright("ros1-env")
    assert (ran.status, ran.err) == (0, "")
    shell = 'eval "$1"; command -v python; python -c "import osrf_gear.msg; print(osrf_gear.msg.Order.__name__)"'
    found = subprocess.run(
        ["bash", "-c", shell, "bash", ran.out], capture_output=True, text=True, timeout=TIMEOUT, check=True
    )
    python, name = found.stdout.splitlines()
    assert Path(python).parent.name == "bin"
    assert name == "Order"


def test_second_evaluation_changes_nothing(cellwright: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    first = cellwright("ros1-env").out
    for line in first.splitlines():
        name, _, value = line.removeprefix("export ").partition("=")
        monkeypatch.setenv(name, value.strip("'"))
    assert cellwright("ros1-env").out == first


def test_dir_option_sets_folder(cellwright: CommandLine, tmp_path: Path) -> None:
    ran = cellwright("ros1-env", "--dir", "mine", "--shell", "fish")
    assert ran.status == 0
    assert f"set -gx ROS_PACKAGE_PATH '{tmp_path}/mine/" in ran.out
    assert not (tmp_path / "cache").exists()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (["--shell", "tcsh"], "error: --shell tcsh: give one of sh, fish\n"),
        (["--dir", "file"], "error: file: cannot write ROS packages: "),
    ],
)
def test_error_of_ros1_env_is_one_line(given: list[str], message: str, cellwright: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    ran = cellwright("ros1-env", *given)
    assert (ran.status, ran.out) == (2, "")
    assert ran.err.startswith(message)
    assert len(ran.err.splitlines()) == 1


def test_ros1_env_without_ros_is_refused(cellwright: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    monkeypatch.setenv("CELLWRIGHT_ROS1_PYTHON", "/nowhere/python3")
    ran = cellwright("ros1-env")
    assert ran.status == 2
    assert ran.err.startswith("error: CELLWRIGHT_ROS1_PYTHON is /nowhere/python3, which has no rospy; ")
    assert len(ran.err.splitlines()) == 1
