"""The lesson can be followed from its first to its last line, on a real ROS 1, as a page and as a notebook."""

import os
import shlex
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from tests.docs.pages import Command, File, steps
from tests.docs.session import follow
from tests.ros1.ground import Ground
from tests.ros1.processes import FAMILY

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "lesson.md"
PACKAGE = ROOT / "examples" / "lesson" / "industrial_control"
LIMIT = 300.0
"""How long a command of the page may take [s]."""


def newcomer(ground: Ground) -> dict[str, str]:
    """The environment of somebody who has installed Cellwright and ROS 1 and done nothing else yet.

    Their home folder is the ground's; of this Python there is the command `cellwright` on their path.
    """
    programs = ground.folder / "bin"
    programs.mkdir()
    command = programs / "cellwright"
    ours = f"PYTHONPATH={shlex.quote(os.environ['PYTHONPATH'])} " if "PYTHONPATH" in os.environ else ""
    command.write_text(f'#!/bin/sh\n{ours}exec {shlex.quote(sys.executable)} -m cellwright "$@"\n')
    command.chmod(0o755)
    kept = {name: value for name, value in ground.environment.items() if name != "PYTHONPATH"}
    return {**kept, "PATH": f"{programs}:{kept['PATH']}", FAMILY: "lesson"}


@pytest.mark.ros1
def test_the_lesson_can_be_followed(no_master: Ground) -> None:
    follow(steps(PAGE), no_master.folder, newcomer(no_master), LIMIT)
