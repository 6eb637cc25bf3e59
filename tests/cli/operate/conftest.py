"""A small robot's node in lockstep, so that its time costs no more than it takes to compute."""

from collections.abc import Iterator

import pytest

from cellwright.robot.node import RobotNode
from tests.clients.operators.nodes import robot, served


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """Where it is reached, HOST:PORT."""
    with served(RobotNode(robot()), lockstep=True) as (host, port):
        yield f"{host}:{port}"


UNCHECKED = "warning: this robot's joint limits are not known here, so nothing is checked against them; see --robot\n"
"""What is said where a robot is neither one that comes along nor described."""
