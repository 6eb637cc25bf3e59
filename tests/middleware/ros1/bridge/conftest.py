"""A bridge between a fake cell and a real master."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import cellwright
from cellwright.cell.interface.rows import SIMULATOR
from tests.middleware.ros1.bridge.fake_cell import FakeCell
from tests.middleware.ros1.bridge.wire import OPENED
from tests.ros1.ground import Ground
from tests.ros1.requirement import ros_python
from tests.support.processes import Process

PROGRAM = Path(cellwright.__file__).parent / "middleware/ros1/bridge/bridge.py"


def start_bridge(
    ground: Ground,
    cell: FakeCell,
    *options: str,
    frames: str = "none",
    ready: bool = True,
    cold: bool = False,
    **more: str,
) -> Process:
    """Start a bridge, and wait until it reports that it is ready.

    Args:
        ground: environment with its master.
        cell: the served cell.
        options: of the bridge.
        frames: path of robot_state_publisher, or `none`.
        ready: wait for its report.
        cold: start an interpreter for it; otherwise it is forked from one that has loaded rospy.
        more: further variables of its environment.
    """
    topics = f"--frame-source={SIMULATOR.frame_source}", f"--subscribe={','.join(SIMULATOR.subscribes)}"
    graph = ["--name=/gazebo", *topics]
    own = ["--connect", cell.address, "--robot-state-publisher", frames, *graph, *options]
    command = [str(ros_python()), str(PROGRAM), *own]
    process = (ground.cold_start if cold else ground.start)(command, folder=None, **more)
    if ready:
        process.wait_for("^ready$")
    return process


@pytest.fixture(autouse=True)
def no_connection_outlives_its_test() -> Iterator[None]:
    yield
    while OPENED:
        OPENED.pop().close()
