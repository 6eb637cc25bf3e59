"""A robot as a page sees it, from a real node's panel, and how it stands with this or that changed."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

from cellwright.server.services.robot_panel import RobotPanel
from cellwright.teleop.node import RobotNode
from cellwright.viewer.web.operator.robot import SeenRobot, Standing
from tests.operators.nodes import robot


@cache
def _panel() -> dict[str, Any]:
    return RobotPanel(RobotNode(robot())).tell({})


def seen() -> SeenRobot:
    """Two arms with a gripper each; joints `right_1` to `right_6`, `right_finger`, and so on."""
    return SeenRobot.read(_panel())


def standing(**changes: Any) -> Standing:
    """It stands at home, and takes commands."""
    return replace(Standing.read(_panel()), **changes)


def number(name: str) -> int:
    """The number of a joint."""
    return next(place for place, joint in enumerate(seen().joints) if joint.name == name)


class Clock:
    """A clock that is set by hand [s]."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        """The time."""
        return self.now
