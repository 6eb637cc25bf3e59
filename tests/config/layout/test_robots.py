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


def test_corners_are_those_of_the_box_in_the_world() -> None:
    robot = CellRobot("left", "tandem", Pose((1.0, 0.0, 0.5)), box=((-0.1, -0.2, 0.0), (0.1, 0.2, 1.0)))
    assert len(set(robot.corners)) == 8
    assert max(robot.corners) == pytest.approx((1.1, 0.2, 1.5))
