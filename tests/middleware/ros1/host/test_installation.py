"""Finding an interpreter that has rospy."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import pytest

from cellwright.middleware.ros1.host import installation
from cellwright.middleware.ros1.host.installation import PYTHON_VARIABLE, Installation, find
from cellwright.util.errors import UsageError

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="ROS 1 is not there")


def script(path: Path, text: str) -> str:
    """Write a shell script."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return str(path)


@pytest.fixture
def bare(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A machine whose own Python has rospy only if $HAS_ROSPY is set."""
    monkeypatch.setattr(installation, "SYSTEM_PYTHON", script(tmp_path / "python3", '[ -n "$HAS_ROSPY" ]'))
    return tmp_path


def test_missing_installation_error_has_instructions(bare: Path) -> None:
    with pytest.raises(UsageError) as caught:
        find({}, root=bare / "ros")
    said = str(caught.value)
    assert "\n" not in said
    for word in ("rospy", "scripts/install-ros1", "apt install", PYTHON_VARIABLE):
        assert word in said


def test_installation_of_shell_environment_is_used_unchanged(bare: Path) -> None:
    said = {"HAS_ROSPY": "1", "PYTHONHOME": "/nowhere", "ROS_NAMESPACE": "/group"}
    found = find(said, root=bare / "ros")
    assert found.python == installation.SYSTEM_PYTHON
    assert found.environment == {"HAS_ROSPY": "1"}


def test_python_named_by_variable_is_used_alone(bare: Path) -> None:
    good, bad = script(bare / "good", "exit 0"), script(bare / "bad", "exit 1")
    assert find({PYTHON_VARIABLE: good}, root=bare).python == good
    for name in (bad, "/no/such/python"):
        with pytest.raises(UsageError, match=f"{PYTHON_VARIABLE} is {name}, which has no rospy"):
            find({PYTHON_VARIABLE: name, "HAS_ROSPY": "1"}, root=bare)


@pytest.mark.skipif(shutil.which("ps") is None, reason="ps is not installed")
def test_interpreter_check_runs_in_own_session(bare: Path) -> None:
    alone = script(bare / "alone", """[ "$(ps -o sid= -p $$ | tr -d ' ')" = "$$" ]""")
    assert find({PYTHON_VARIABLE: alone, "PATH": os.environ["PATH"]}, root=bare).python == alone


def test_installation_under_opt_is_sourced(bare: Path) -> None:
    root = bare / "ros"
    for name in ("kinetic", "noetic"):
        (root / name).mkdir(parents=True)
        (root / name / "setup.bash").write_text(f"echo noise; export HAS_ROSPY=1 ROS_DISTRO={name} TWO='a\nb'\n")
        script(root / name / "bin" / "rosmaster", "exit 0")
    (root / "rolling").mkdir()
    (root / "rolling" / "setup.bash").write_text("export HAS_ROSPY=1 ROS_DISTRO=rolling\n")  # ROS 2 has no rosmaster
    found = find({"KEPT": "1"}, root=root)
    assert found.environment["ROS_DISTRO"] == "noetic"
    assert found.environment["KEPT"] == "1"
    assert found.environment["TWO"] == "a\nb"


def test_programs_are_found_in_installation(tmp_path: Path) -> None:
    program = script(tmp_path / "bin" / "rosmaster", "exit 0")
    node = script(tmp_path / "lib" / "rosout" / "rosout", "exit 0")
    (tmp_path / "lib" / "rosout" / "notes").write_text("no program")
    found = Installation("/usr/bin/python3", {"PATH": str(tmp_path / "bin")}, (Path("/nowhere"), tmp_path))
    assert found.program("rosmaster") == program
    assert found.program("roscore") is None
    assert found.node("rosout", "rosout") == node
    assert found.node("rosout", "notes") is None
    assert found.node("tf", "tf_echo") is None


def test_prefixes_of_shell_come_first(bare: Path) -> None:
    environment = {"HAS_ROSPY": "1", "CMAKE_PREFIX_PATH": os.pathsep.join(["/a", "/b"])}
    assert find(environment, root=bare / "ros").prefixes == (Path("/a"), Path("/b"), Path("/usr"))
