"""Robots built by hand for tests."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cellwright.config.models.model import ModelShape
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import Joint, Link, RobotModel
from cellwright.util.pose import Pose


def one_link(*shapes: ModelShape, base_pose: Pose | None = None) -> RobotConfig:
    """Return a robot with one link and no joint."""
    robot = RobotModel("stone", "stone", {"stone": Link("stone", shapes=shapes)}, ())
    return RobotConfig(robot, "stone", Path("stone.urdf"), Path("stone.urdf"), base_pose or Pose())


def of_joints(*joints: Joint, links: Mapping[str, Link] | None = None, **config: Any) -> RobotConfig:
    """Return a robot of these joints, the first of which hangs on its root; links are bare unless given."""
    root = joints[0].parent
    names = [root, *(joint.child for joint in joints)]
    robot = RobotModel("robot", root, {name: (links or {}).get(name, Link(name)) for name in names}, joints)
    return RobotConfig(robot, "robot", Path("robot.urdf"), Path("robot.urdf"), **config)
