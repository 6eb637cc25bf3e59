"""The fixtures for tests against ROS 1, known to all tests by way of tests/conftest.py.

A test that uses them is marked `ros1`. `master` is what most need: `master.serve("lesson")` is a cell that is ready,
`master.client(function, …).value()` what a client found, `master.tool("rostopic", "list")` what a tool printed.
"""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.ros1.ground import Ground, ground
from tests.ros1.messages import generate


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
