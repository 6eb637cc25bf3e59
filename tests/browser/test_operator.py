"""Robot driven in a real browser: a dragged hand, a typed joint position, and the stop button."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from cellwright.config.robot.robots import load_robot
from cellwright.robot.node import RobotNode
from cellwright.viewer.web.connection import ServerConnection
from cellwright.viewer.web.start import WebPage, page_source
from tests.browser.conftest import Visit
from tests.browser.seen import Hues, of_hue
from tests.browser.visitor import COARSE, Visitor
from tests.support.quick_children import QUICK_PAGES
from tests.viewer.web.operator.robots import served

pytestmark = pytest.mark.browser

UPWARD = Hues(centre=212.0, width=14.0, saturation=0.55, value=0.5)
"""Colour of the arrow that points up; this robot has no other blue."""
_MIN_PIXELS = 20  # pixels of it


class Robot:
    """Served robot, and its page."""

    def __init__(self, address: tuple[str, int], url: str) -> None:
        self.url = url
        self.link = ServerConnection(address, node="/test")

    def panel(self) -> dict[str, Any]:
        """State of the robot."""
        return self.link.ask("cellwright/panel")

    def height(self) -> float:
        """Height of the higher hand [m]."""
        return max(float(tip[2]) for tip in self.panel()["tips"])


@pytest.fixture
def robot() -> Iterator[Robot]:
    node = RobotNode(load_robot("tandem", print))
    with served(node) as address:
        page = WebPage(page_source(address), port=0)
        found = Robot(address, page.url)
        yield found
        found.link.close()
        page.close()
    node.close()


def drag_a_hand_up(visitor: Visitor, robot: Robot) -> None:
    """Grab the highest arrow, and pull."""
    mouse, before = visitor.page.mouse, robot.height()

    def is_higher() -> bool:
        return robot.height() > before + 0.02

    def drag() -> bool:
        """Try once: the page may not have drawn the latest state, or noticed the mouse on the arrow."""
        rows, columns = np.nonzero(of_hue(visitor.canvas(), UPWARD))
        if len(rows) < _MIN_PIXELS:
            return False
        x, y = (float(np.median(columns[rows <= rows.min() + 2])) + 0.5) / COARSE, (float(rows.min()) + 2.0) / COARSE
        mouse.move(x + 3.0, y + 3.0)
        mouse.move(x, y)
        visitor.frames(5)
        mouse.down()
        mouse.move(x, y - 20.0, steps=4)
        mouse.move(x, y - 60.0, steps=4)
        visitor.frames(30, until=is_higher)
        mouse.up()
        return is_higher()

    visitor.wait(drag, "hand that is dragged up", seen=lambda: f"{before:.3f} m before, {robot.height():.3f} m after")


@QUICK_PAGES
def test_robot_is_driven_from_browser(visit: Visit, robot: Robot) -> None:
    visitor = visit(robot.url)
    visitor.read("^idle")
    left = robot.panel()["tips"]
    drag_a_hand_up(visitor, robot)
    moved = [now[2] - then[2] for now, then in zip(robot.panel()["tips"], left, strict=True)]
    assert min(moved) == pytest.approx(0.0, abs=2e-3), "the other hand stays"
    visitor.read("delay [0-9]+ ms")

    visitor.page.get_by_text("Lift", exact=True).first.click()
    lift = next(place for place, joint in enumerate(robot.panel()["robot"]["joints"]) if joint["name"] == "lift")
    visitor.page.get_by_text("lift", exact=True).last.wait_for()
    field = visitor.page.locator("input.mantine-NumberInput-input:visible").last
    field.fill("0.1")
    field.press("Enter")
    visitor.wait(lambda: abs(robot.panel()["positions"][lift] - 0.1) < 5e-3, "lift at 0.1 m")

    visitor.press("STOP")
    visitor.wait(lambda: robot.panel()["stopped"], "emergency stop")
    visitor.read("emergency stop by /browser_operator")
    visitor.press("Clear emergency stop")
    visitor.wait(lambda: not robot.panel()["stopped"], "end of the stop")
