"""Fixtures for tests with ROS 2; a test that uses them is marked `ros2`."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.ros2.ground import Ground, ground


@pytest.fixture
def domain(tmp_path: Path) -> Iterator[Ground]:
    """A domain of its own."""
    with ground(tmp_path) as made:
        yield made
