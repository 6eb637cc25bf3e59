"""Robot as a page sees it, from a real node's panel, and states of it with changes."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from typing import Any

from cellwright.engine.loop import SimulationLoop
from cellwright.middleware.server import Server
from cellwright.robot.node import RobotNode
from cellwright.viewer.services.names import PANEL
from cellwright.viewer.services.robot_panel import RobotPanel
from cellwright.viewer.services.scene import SceneServices, ServedScene
from cellwright.viewer.web.operator.robot_state import RobotState, SeenRobot
from tests.clients.operators.nodes import robot
from tests.support.waiting import TIMEOUT


@cache
def _panel() -> dict[str, Any]:
    return RobotPanel(RobotNode(robot())).state({})


@cache
def seen() -> SeenRobot:
    """Two arms with a gripper each; joints `right_1` to `right_6`, `right_finger`, and so on."""
    return SeenRobot.read(_panel())


def state(**changes: Any) -> RobotState:
    """State at home, with commands enabled."""
    return replace(_at_home(), **changes)


@cache
def _at_home() -> RobotState:
    return RobotState.read(_panel())


def number(name: str) -> int:
    """Number of a joint."""
    return next(place for place, joint in enumerate(seen().joints) if joint.name == name)


class Clock:
    """Clock that tests set [s]."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        """Current time."""
        return self.now


@contextmanager
def served(node: RobotNode, port: int = 0) -> Iterator[tuple[str, int]]:
    """Address of a node in real time with its scene and its panel, served by a thread."""
    server = Server(node, port=port)
    SceneServices(ServedScene(node)).offer(server)
    panel = RobotPanel(node)
    server.offer(PANEL, panel.state)
    loop = SimulationLoop(node.simulation, server)
    thread = threading.Thread(target=loop.run)
    thread.start()
    try:
        yield server.address
    finally:
        loop.stop.request()
        thread.join(TIMEOUT)
        server.close("the test is over")
