"""Robots that tests put together by hand."""

from pathlib import Path

from cellwright.description.model import ModelShape
from cellwright.description.robot.config import RobotConfig
from cellwright.description.robot.model import Link, RobotModel
from cellwright.pose import Pose


def one_link(*shapes: ModelShape, base_pose: Pose | None = None) -> RobotConfig:
    """A robot that is one link and cannot move."""
    robot = RobotModel("stone", "stone", {"stone": Link("stone", shapes=shapes)}, ())
    return RobotConfig(robot, "stone", Path("stone.urdf"), Path("stone.urdf"), base_pose or Pose())
