"""The fixtures for tests against ROS 1, known to all tests by way of tests/conftest.py.

A test that uses them is marked `ros1`. `master` is what most need: `master.serve("lesson")` is a cell that is ready,
`master.client(function, …).value()` what a client found, `master.tool("rostopic", "list")` what a tool printed.
"""

import os
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.processes import FAMILY, members, name_of
from tests.ros1.ground import Ground, ground
from tests.ros1.messages import generate
from tests.waiting import wait_until

SMALL_PICTURES = Path(__file__).parents[1] / "small_pictures.py"


@pytest.fixture(scope="session")
def ros1_messages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of Python modules osrf_gear, control_msgs and cellwright_msgs, as ROS 1 generates them."""
    folder = tmp_path_factory.mktemp("messages")
    generate(folder)
    return folder


@pytest.fixture
def master(tmp_path: Path, ros1_messages: Path) -> Iterator[Ground]:
    """A bare master on a free port."""
    with ground(tmp_path, ros1_messages) as made:
        yield made


@pytest.fixture
def full_master(tmp_path: Path, ros1_messages: Path) -> Iterator[Ground]:
    """A whole roscore, with rosout, on a free port."""
    with ground(tmp_path, ros1_messages, roscore=True) as made:
        yield made


@pytest.fixture
def no_master(tmp_path: Path, ros1_messages: Path) -> Iterator[Ground]:
    """A free port at which no master answers yet."""
    with ground(tmp_path, ros1_messages, master=False) as made:
        yield made


@pytest.fixture
def newcomer(no_master: Ground) -> Iterator[dict[str, str]]:
    """The environment of somebody who has installed Cellwright and ROS 1, and done nothing else yet.

    Their home folder is empty; of this Python there is the command `cellwright` on their path, which draws small
    pictures. In the end nothing that they have started may be left.
    """
    programs, home = no_master.folder / "bin", no_master.folder / "home"
    for folder in (programs, home):
        folder.mkdir()
    command = programs / "cellwright"
    modules = f"PYTHONPATH={shlex.quote(os.environ['PYTHONPATH'])} " if "PYTHONPATH" in os.environ else ""
    program = shlex.join([sys.executable, "-P", str(SMALL_PICTURES)])
    command.write_text(f'#!/bin/sh\n{modules}exec {program} "$@"\n')
    command.chmod(0o755)
    foreign = ("PYTHONPATH", "ROSCONSOLE_CONFIG_FILE")
    kept = {name: value for name, value in no_master.environment.items() if name not in foreign}
    family = f"newcomer at {no_master.port}"
    yield {**kept, "PATH": f"{programs}:{kept['PATH']}", "HOME": str(home), FAMILY: family}
    wait_until(lambda: not members(family), "end of all processes", seen=lambda: list(map(name_of, members(family))))
