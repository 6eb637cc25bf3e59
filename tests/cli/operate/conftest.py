"""A small robot's node in lockstep, whose time costs no more than its computation."""

from collections.abc import Iterator

import pytest

from cellwright.robot.node import RobotNode
from tests.clients.operators.nodes import robot, served


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """Yield its address, HOST:PORT."""
    with served(RobotNode(robot()), lockstep=True) as (host, port):
        yield f"{host}:{port}"


UNCHECKED = "warning: joint limits unknown: targets are not checked against them; give the description with --robot\n"
"""Warning for a robot that is neither bundled nor described."""
