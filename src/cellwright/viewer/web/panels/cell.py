"""A cell beside its scene: what it is and how it stands, its orders, trays and score, and what one may do to it."""

from __future__ import annotations

import time
from typing import Any

from cellwright.middleware.messages.osrf_gear import AGVControlRequest, ConveyorBeltControlRequest, ConveyorBeltState
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.rendering.scene import Scene
from cellwright.util.errors import CellwrightError
from cellwright.viewer.services.names import PANEL
from cellwright.viewer.web import html
from cellwright.viewer.web.feature import Feature
from cellwright.viewer.web.page import Page, refused
from cellwright.viewer.web.panels import cell_html
from cellwright.viewer.web.shown import Shown

ORDERS, SCORE, CELL = "Orders", "Score", "Cell"
"""Names of the tabs."""

START, END = "Start", "End"
STRANGE = (KeyError, TypeError, ValueError, IndexError, AttributeError)
"""What comes of a panel that was recorded by another version, or is none: it must not end the page."""

_SETTLED = 1.5  # [s] after one has moved the belt's slider before it follows the belt again
_ORDER = -20.0  # above all else


class CellPanels(Feature):
    """Shows a cell, also one that was recorded."""

    def __init__(self) -> None:
        self._page: Page | None = None
        self._is_up = False
        self._slid_at = -_SETTLED

    def begin(self, page: Page, scene: Scene) -> None:  # noqa: ARG002
        """Put the panels up, once, where a cell is shown."""
        self._page = page
        if self._is_up:
            return
        try:
            told = cell_of(page.link.ask(PANEL))
        except CellwrightError:
            return
        if told is not None:
            self._put_up(page)

    def panel(self, panel: dict[str, Any]) -> None:
        """Show how the cell stands."""
        told = cell_of(panel)
        if told is None or self._page is None:
            return
        if not self._is_up:
            self._put_up(self._page)
        try:
            self._show(told)
            self._allow(told, is_recorded=panel.get("kind") != "cell")
        except STRANGE as error:
            self._head.show(html.block(html.dim(f"This panel is of another version, and cannot be shown: {error!r}")))

    def away(self, reason: str) -> None:
        """Nobody answers: offer nothing."""
        if self._is_up:
            self._offer(reason)

    # ---------------------------------------------------------------- what is there

    def _put_up(self, page: Page) -> None:
        self._is_up, gui = True, page.server.gui
        self._head = Shown(gui, _ORDER)
        self._time = Shown(gui, _ORDER / 4)
        with page.tab(ORDERS):
            self._orders, self._trays = Shown(gui), Shown(gui)
        with page.tab(SCORE):
            self._evidence = Shown(gui)
        with page.tab(CELL):
            self._floor = Shown(gui)
            self._why_not = Shown(gui)
            self._game = gui.add_button_group("competition", (START, END))
            self._belt = gui.add_slider("belt [%]", min=0.0, max=100.0, step=1.0, initial_value=0.0)
            self._kit = gui.add_dropdown("kit", ("(none)",))
            self._send = gui.add_button_group("send as that kit", ("AGV 1", "AGV 2"))
            self._clear = gui.add_button_group("clear tray", ("tray 1", "tray 2"))
        self._doing = (self._game, self._belt, self._kit, self._send, self._clear)
        self._game.on_click(lambda event: self._play(str(event.target.value)))
        self._belt.on_update(self._set_power)
        self._send.on_click(lambda event: self._send_off(_number(event.target.value)))
        self._clear.on_click(lambda event: self._clear_tray(_number(event.target.value)))

    def _show(self, told: dict[str, Any]) -> None:
        self._head.show(cell_html.head(told))
        self._time.show(cell_html.game(told))
        self._orders.show(cell_html.orders(told))
        self._trays.show(cell_html.trays(told))
        self._evidence.show(cell_html.evidence(told))
        self._floor.show(cell_html.floor(told))
        if time.perf_counter() - self._slid_at > _SETTLED:
            self._belt.value = float(told["belt"]["power"])  # type: ignore[misc]
        kits = tuple(kit["kit_type"] for order in told["orders"] for kit in order["kits"] if not kit["submitted"])
        if tuple(self._kit.options) != (kits or ("(none)",)):
            self._kit.options = kits or ("(none)",)

    def _allow(self, told: dict[str, Any], *, is_recorded: bool) -> None:
        """Let one do what is allowed; where it is not, say why."""
        reason = "this is a recording: nothing can be changed any more" if is_recorded else ""
        self._offer(reason or told["refused"].get("belt", ""))

    def _offer(self, reason: str) -> None:
        """Offer what one may do, unless there is a reason not to."""
        self._why_not.show(html.block(html.dim(f"Belt, AGVs and trays: {reason}.")) if reason else "")
        for handle in self._doing:
            if handle.visible == bool(reason):
                handle.visible = not reason  # viser disables no group of buttons

    # ---------------------------------------------------------------- what one does

    def _play(self, word: str) -> None:
        self._call("/ariac/start_competition" if word == START else "/ariac/end_competition", TriggerRequest())

    def _set_power(self, event: Any) -> None:
        if event.client is not None:  # not when it follows the belt
            self._slid_at = time.perf_counter()
            power = ConveyorBeltState(power=float(event.target.value))
            self._call("/ariac/conveyor/control", ConveyorBeltControlRequest(state=power))

    def _send_off(self, number: int) -> None:
        self._call(f"/ariac/agv{number}", AGVControlRequest(kit_type=str(self._kit.value)))

    def _clear_tray(self, number: int) -> None:
        self._call(f"/ariac/kit_tray_{number}/clear_tray", TriggerRequest())

    def _call(self, service: str, request: Any) -> None:
        assert self._page is not None
        try:
            response = self._page.link.call(service, request)
        except CellwrightError as error:
            refused(self._page, f"{service}: refused", error)
            return
        if not response.success:
            said = getattr(response, "message", "") or "not now"
            self._page.tell(f"{service}: refused", str(said), is_bad=True)


def cell_of(panel: dict[str, Any]) -> dict[str, Any] | None:
    """The cell that a panel tells of, or that a recording told of then; None where it is none."""
    found = panel.get("of") if panel.get("kind") == "recording" else panel
    return found if isinstance(found, dict) and found.get("kind") == "cell" else None


def _number(word: object) -> int:
    return int(str(word)[-1])
