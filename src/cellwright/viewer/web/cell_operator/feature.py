"""Operator of a cell on its page: there once an operator agent works the cell."""

from __future__ import annotations

import time
from typing import Any

from cellwright.clients.agents.operator.requests import VELOCITY, velocity_request
from cellwright.rendering.scene import Scene
from cellwright.util.errors import CellwrightError
from cellwright.viewer.web.cell_operator.arms import OperatorState, described_arms
from cellwright.viewer.web.cell_operator.controls import CellControls
from cellwright.viewer.web.cell_operator.handles import ToolHandles
from cellwright.viewer.web.cell_operator.sender import Sender
from cellwright.viewer.web.input import Input, jog
from cellwright.viewer.web.page import Feature

TAB = "Drive"
_NOTE = 6.0  # [s] for which a refusal is shown


class CellOperator(Feature):
    """Operator of the page's cell, once a panel has the report of an operator agent."""

    def __init__(self) -> None:
        self._sender: Sender | None = None
        self._handles: ToolHandles | None = None
        self._controls: CellControls | None = None
        self._note, self._noted = "", float("-inf")
        self._buttons: frozenset[str] = frozenset()

    def on_scene(self, scene: Scene) -> None:  # noqa: ARG002
        """Start another scene: its handles went with the previous one."""
        self._handles = None
        if _report(self.page.first_panel) is not None:
            self.page.tab(TAB)  # its tab comes first

    def panel(self, panel: dict[str, Any]) -> None:
        """Show what the agent has reported, if there is one."""
        report = _report(panel)
        if report is None:
            self._show(None, panel)
            return
        try:
            state = OperatorState.read(report)
            if self._handles is None or self._controls is None:
                self._build(panel)
        except CellwrightError as error:
            self._say(str(error))
            return
        self._show(state, panel)

    def on_input(self, given: Input) -> None:
        """Take the keys and the gamepad of a browser, in the thread that reads its messages."""
        if self._sender is None or self._controls is None:
            return
        linear, angular = jog(given)
        if any(linear) or any(angular):
            self._sender.put(VELOCITY, velocity_request(linear, angular))
        pressed = frozenset(given.pressed)
        for name in sorted(pressed - self._buttons):
            if name in ("grip", "release"):
                self._controls.grip(enable=name == "grip")
            else:
                self._sender.command(name)
        self._buttons = pressed

    def on_disconnect(self, reason: str) -> None:  # noqa: ARG002
        """Hide the handles: the server does not answer."""
        if self._handles is not None:
            self._handles.show(None)
        if self._controls is not None:
            self._controls.show(None, (), "")

    def _build(self, panel: dict[str, Any]) -> None:
        page = self.page
        arms = described_arms(page.link)
        if self._sender is None:
            self._sender = Sender(page.link.sibling(), self._say)
        if self._controls is not None:
            self._controls.remove()
        senders = {str(each["name"]): f"/ariac/{each['name']}" for each in (*panel["agvs"], *panel["fixed_trays"])}
        self._handles = ToolHandles(page.server.scene, page.root, arms, self._sender)
        self._controls = CellControls(page.server.gui, lambda: page.tab(TAB), arms, senders, self._sender)

    def _show(self, state: OperatorState | None, panel: dict[str, Any]) -> None:
        if self._handles is None or self._controls is None:
            return
        self._handles.show(state)
        kits = [kit["kit_type"] for order in panel["orders"] for kit in order["kits"] if not kit["submitted"]]
        note = self._note if time.perf_counter() - self._noted < _NOTE else ""
        self._controls.show(state, kits, note)

    def _say(self, text: str) -> None:
        self._note, self._noted = text, time.perf_counter()


def _report(panel: dict[str, Any]) -> dict[str, Any] | None:
    """Return the report of the agent in the panel of a cell that runs; None without one."""
    if panel.get("kind") != "cell" or panel.get("result") is not None:
        return None
    found = panel.get("operator")
    return found if isinstance(found, dict) else None
