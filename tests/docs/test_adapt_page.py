"""The page that leads from a URDF to a moving robot can be followed from its first line to its last."""

import os
import shlex
import shutil
import sys
from pathlib import Path

import pytest

from tests.docs.pages import steps
from tests.docs.robot_pages import at, shell
from tests.docs.session import follow
from tests.ports import free_port
from tests.warm import WarmStart

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "adapt-a-robot.md"


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix" or shutil.which("setsid") is None, reason="needs terminals")
def test_adapt_page_followed_in_terminals_prints_what_it_shows(tmp_path: Path, warm: WarmStart) -> None:
    home, programs = tmp_path / "home", tmp_path / "bin"
    shutil.copytree(ROOT / "docs" / "examples" / "adapt_a_robot", home)
    shutil.copy(ROOT / "examples" / "my_driver.py", home)
    programs.mkdir()
    modules = f"PYTHONPATH={shlex.quote(str(ROOT / 'src'))} exec {shlex.quote(sys.executable)}"
    (programs / "python").write_text(f'#!/bin/sh\n{modules} "$@"\n')
    (programs / "python").chmod(0o755)
    port = free_port()
    with shell(home, programs, warm) as environment:
        follow([at(port, step) for step in steps(PAGE)], home, environment)
    assert (home / "picker.png").read_bytes().startswith(b"\x89PNG")
