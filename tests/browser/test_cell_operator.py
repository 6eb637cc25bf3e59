"""A person builds a kit in a real browser: drags the tool, uses the aids, and sends the kit off."""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cellwright.rendering.camera import Camera
from cellwright.util.pose import Pose, Vector3
from cellwright.viewer.services.names import PANEL
from cellwright.viewer.web.cell_operator.arms import described_arms
from cellwright.viewer.web.cell_operator.controls import GRIP, RELEASE, SNAP
from cellwright.viewer.web.connection import ServerConnection
from tests.browser.conftest import Visit
from tests.browser.serving import viewed
from tests.browser.visitor import HEIGHT, WIDTH, Visitor
from tests.support.processes import Process
from tests.support.waiting import TIMEOUT
from tests.support.warm import warm_start

pytestmark = pytest.mark.browser

EYE, TARGET = (-2.3, -1.1, 2.0), (-0.15, 0.35, 0.95)
KIT = f"""
cell:
  bins: {{bin1: {{at: [-0.35, 0.0], size: [0.6, 0.5], surface: 0.72}}}}
  trays: {{tray1: {{at: [-0.35, 0.8], surface: 0.755}}}}
  arms: {{arm: {{mount: {{kind: rail, at: [0.3, 0, 0.9]}}}}}}
  views: {{overview: {{at: {list(EYE)}, to: {list(TARGET)}}}}}
parts: [{{type: gear_part, in: bin1, grid: [1, 1]}}]
orders: {{order_0: {{tray: tray1, parts: [{{type: gear_part, xy: [0, 0]}}]}}}}
time_limit: 2000
"""
"""A gear in a bin beside a fixed tray, before an arm on a rail."""
GEAR, TRAY = (-0.35, 0.0, 0.74), (-0.35, 0.8, 0.755)
"""Top of the gear, and middle of the tray's surface [m]."""
ARROW = 0.24
"""Distance along an axis at which its arrow is grabbed [m]."""
AXES: tuple[Vector3, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Hand:
    """The person's hand: it drags the arrows of the tool's handle.

    Args:
        visitor: window on the page.
        link: connection to the cell.
    """

    def __init__(self, visitor: Visitor, link: ServerConnection) -> None:
        self.visitor, self.link = visitor, link
        self.arm = described_arms(link)["arm"]
        self.camera = Camera(EYE, TARGET)

    def panel(self) -> dict[str, Any]:
        """The cell's panel."""
        return self.link.ask(PANEL)

    def report(self) -> dict[str, Any]:
        """Newest report of the agent about the arm."""
        found: dict[str, Any] = self.panel()["operator"]["arms"]["arm"]
        return found

    def tool(self) -> Pose:
        """Pose of the tool."""
        return self.arm.world_T_tool(self.report()["joints"])

    def pixel(self, point: Vector3) -> tuple[float, float]:
        """Return where a point of the world is in the window."""
        x, y, z = self.camera.world_R_optical.T @ np.subtract(point, EYE)
        slope = 2 * math.tan(self.camera.fov / 2) / HEIGHT
        return float(x / z / slope + WIDTH / 2), float(y / z / slope + HEIGHT / 2)

    def rests(self) -> bool:
        """Return whether the arm rests."""
        return bool(self.report()["mode"] in ("idle", "blocked"))

    def drag_to(self, goal: Vector3, within: float = 0.03) -> None:
        """Drag the tool along one axis after another, until it is at a place."""
        for _ in range(12):
            self.visitor.wait(self.rests, "arm that rests", seen=self.report)
            self.visitor.frames(4)  # the handle is where the tool is
            way = np.subtract(goal, self.tool().position)
            if float(np.abs(way).max()) < within:
                return
            axis = int(np.abs(way).argmax())
            self._drag(axis, float(np.clip(way[axis], -0.4, 0.4)))
        raise AssertionError(f"tool at {self.tool().position}, not at {goal}; {self.report()}")

    def _drag(self, axis: int, way: float) -> None:
        mouse, origin, direction = self.visitor.page.mouse, np.array(self.tool().position), np.array(AXES[axis])
        x, y, z = (origin + ARROW * direction).tolist()
        a, b, c = (origin + (ARROW + way) * direction).tolist()
        (begin_x, begin_y), (end_x, end_y) = self.pixel((x, y, z)), self.pixel((a, b, c))
        mouse.move(begin_x + 4.0, begin_y + 4.0)
        mouse.move(begin_x, begin_y)
        self.visitor.frames(4)  # the page notices the mouse on the arrow
        mouse.down()
        for share in (0.1, 0.4, 0.7, 1.0):
            mouse.move(begin_x + share * (end_x - begin_x), begin_y + share * (end_y - begin_y))
            self.visitor.frames(2)
        mouse.up()
        self.visitor.page.wait_for_timeout(400)


def test_person_builds_a_kit_with_the_mouse(tmp_path: Path, visit: Visit) -> None:
    (tmp_path / "kit.yaml").write_text(KIT)
    command = ("run", "kit.yaml", "--operator", "-d", "--record", "run.mcap", "--no-picture")
    with viewed(tmp_path, *command) as run:
        address = run.wait_for(r"^operator: .* at ([\d.]+):(\d+)")
        link = ServerConnection((address[1], int(address[2])), node="/test")
        visitor = visit(run.url)
        visitor.page.get_by_role("tab", name="Drive").click()
        visitor.read("begins with your first motion")
        hand = Hand(visitor, link)
        hand.drag_to((GEAR[0], GEAR[1], 1.0), within=0.05)
        visitor.press(GRIP)
        visitor.press(SNAP)
        visitor.wait(lambda: hand.panel()["grippers"][0]["attached"], "gear on the cup", seen=hand.report)
        hand.drag_to((GEAR[0], GEAR[1], 1.0), within=0.1)
        hand.drag_to((TRAY[0], TRAY[1], 1.0))
        hand.drag_to((TRAY[0], TRAY[1], TRAY[2] + 0.04), within=0.02)
        visitor.press(RELEASE)
        visitor.wait(lambda: hand.panel()["trays"][0]["parts"], "gear on the tray", seen=hand.report)
        visitor.press("tray1")
        visitor.read("^done$")
        run.wait_for("^the page stays open")
        link.close()
        assert run.interrupt() == 0
    exported(tmp_path)


def exported(folder: Path) -> None:
    """Export the recording of the person's run, and check the set."""
    export = ("export", "run.mcap", "--out", "set", "--sentence", "Build the kit.")
    for arguments in (export, ("export", "--check", "set")):
        process = Process([sys.executable, "-m", "cellwright", *arguments], os.environ, folder, warm=warm_start())
        try:
            assert process.finish(4 * TIMEOUT) == 0, process.said
        finally:
            process.kill()
