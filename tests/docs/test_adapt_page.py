"""The page that leads from a URDF to a moving robot can be followed from its first line to its last."""

import os
import shlex
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from tests.docs.pages import Command, Step, steps
from tests.docs.session import follow
from tests.ports import free_port

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "adapt-a-robot.md"


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix" or shutil.which("setsid") is None, reason="needs terminals")
def test_the_page_can_be_followed(tmp_path: Path) -> None:
    home, programs = tmp_path / "home", tmp_path / "bin"
    shutil.copytree(ROOT / "docs" / "examples" / "adapt_a_robot", home)
    shutil.copy(ROOT / "examples" / "my_driver.py", home)
    programs.mkdir()
    modules = f"PYTHONPATH={shlex.quote(str(ROOT / 'src'))} exec {shlex.quote(sys.executable)}"
    for name, what in (("cellwright", '-m cellwright "$@"'), ("python", '"$@"')):
        (programs / name).write_text(f"#!/bin/sh\n{modules} {what}\n")
        (programs / name).chmod(0o755)
    environment = {"PATH": f"{programs}:{os.environ['PATH']}", "HOME": str(home), "COLUMNS": "100", "LANG": "C.UTF-8"}
    port = free_port()
    follow([_at(step, port) for step in steps(PAGE)], home, environment)
    assert (home / "picker.png").read_bytes().startswith(b"\x89PNG")


def _at(step: Step, port: int) -> Step:
    """A step with a port of the test's own in place of the one that a single robot has."""
    if not isinstance(step, Command):
        return step
    more = {"cellwright teleop": f" --port {port}", "cellwright operate": f" --connect 127.0.0.1:{port}"}
    more["python wave.py"] = f" 127.0.0.1:{port}"
    return replace(
        step, line=step.line + next((what for start, what in more.items() if step.line.startswith(start)), "")
    )
