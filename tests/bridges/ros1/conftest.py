"""A bridge between a fake cell and a real master."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import cellwright
from tests.bridges.ros1.fake_cell import FakeCell
from tests.bridges.ros1.wire import OPENED
from tests.processes import Process
from tests.ros1.ground import Ground
from tests.ros1.requirement import ros_python

PROGRAM = Path(cellwright.__file__).parent / "bridges/ros1/__main__.py"


def start_bridge(
    ground: Ground, cell: FakeCell, *options: str, frames: str = "none", ready: bool = True, **more: str
) -> Process:
    """Start a bridge, `more` in its environment, and wait until it says that it is ready."""
    command = [str(ros_python()), str(PROGRAM), "--connect", cell.address, "--robot-state-publisher", frames, *options]
    process = ground.start(command, folder=None, **more)
    if ready:
        process.wait_for("^ready$")
    return process


@pytest.fixture(autouse=True)
def no_connection_outlives_its_test() -> Iterator[None]:
    yield
    while OPENED:
        OPENED.pop().close()
