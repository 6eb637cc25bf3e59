"""Robots of a layout."""

from math import pi

import pytest

from cellwright.config.layout.robots import CellRobot
from cellwright.util.pose import Pose


def test_robot_moves_with_the_cell() -> None:
    robot = CellRobot("left", "tandem", Pose((1.0, 0.0, 0.5)))
    moved = robot.moved(Pose.from_rpy((2.0, 1.0, 0.0), (0.0, 0.0, pi / 2)))
    assert moved.pose.position == pytest.approx((2.0, 2.0, 0.5))
    assert (moved.name, moved.model, moved.prefix) == ("left", "tandem", "left/")
