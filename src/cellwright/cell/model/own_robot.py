"""Robot of the robot face in the engine's model of a cell: links on their place, with drives that hold them."""

from __future__ import annotations

from typing import Any

from cellwright.cell.model.own_models import add_link
from cellwright.config.layout.robots import CellRobot
from cellwright.config.robot.config import RobotConfig, initial_posture
from cellwright.config.robot.model import Link
from cellwright.config.trial.trial import Trial
from cellwright.engine.shapes import Role, Shape, Visuals, add_shape
from cellwright.mechanism.robot_bodies import add_robot
from cellwright.mechanism.shapes import ShapeBuilder, pose_arguments

_POINT = Shape("sphere", (0.001, 0.0, 0.0))
"""Grasp point of a hand, to which distances are measured."""


def add_own_robot(spec: Any, visuals: Visuals, robot: CellRobot, config: RobotConfig) -> None:
    """Add a robot to a model specification, before the parts.

    Its weight is compensated, and its links do not touch each other.

    Args:
        spec: model specification.
        visuals: receives what is only seen of it.
        robot: the robot.
        config: its configuration.

    Raises:
        ModelFileError: a mesh cannot be used.
    """
    grasps = {f"{robot.prefix}{hand.link}": hand.name for hand in robot.hands}

    def fill(body: Any, link: Link) -> None:
        body.gravcomp = 1.0
        add_link(spec, visuals, body, link)
        if link.name in grasps:
            add_shape(body, _POINT, Role.UNSEEN, name=grasps[link.name])

    base = spec.worldbody.add_body(name=robot.base, **pose_arguments(robot.pose))
    extent = ShapeBuilder(spec, is_touched=True, is_seen=False).extent
    add_robot(spec, base, config, fill, extent=extent, prefix=robot.prefix)


def first_positions(trial: Trial) -> dict[str, float]:
    """Return the positions [rad; m] of all joints of robots in which a run begins, by their names in the engine."""
    return {
        f"{robot.prefix}{name}": position
        for robot in trial.layout.robots
        for name, position in initial_posture(
            trial.robot_models[robot.name], trial.robot_starts.get(robot.name, {})
        ).items()
    }
