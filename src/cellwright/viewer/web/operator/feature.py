"""The part of a page that drives a robot; on a page of anything else it does nothing."""

from __future__ import annotations

import time
from typing import Any

from cellwright.rendering.scene import Scene
from cellwright.util.errors import CellwrightError
from cellwright.viewer.services.names import PANEL
from cellwright.viewer.web.feature import Feature
from cellwright.viewer.web.operator.controls import Controls
from cellwright.viewer.web.operator.desk import Desk
from cellwright.viewer.web.operator.handles import Handles
from cellwright.viewer.web.operator.worker import Worker
from cellwright.viewer.web.page import Page

KIND = "robot"
TAB = "Drive"


class Operator(Feature):
    """Drives the robot that is there, once its panel has told that it is one."""

    def __init__(self) -> None:
        self._page: Page | None = None
        self._worker: Worker | None = None
        self._handles: Handles | None = None
        self._controls: Controls | None = None
        self._shown: Desk | None = None  # whose handles and controls there are
        self._is_robot = False

    def begin(self, page: Page, scene: Scene) -> None:  # noqa: ARG002
        """Another scene: its handles went with the one before."""
        self._page = page
        self._handles = self._shown = None
        try:
            self.panel(page.link.ask(PANEL))  # now, so that the tab is the first one
        except CellwrightError:
            return  # there is no panel, or it comes later

    def panel(self, panel: dict[str, Any]) -> None:
        """It is a robot, or it is not."""
        self._is_robot = panel.get("kind") == KIND
        if self._is_robot and self._worker is None and self._page is not None:
            self._worker = worker = Worker(self._page.link.address)
            server = self._page.server
            server.on_client_connect(lambda _client: setattr(worker, "is_watched", True))
            server.on_client_disconnect(lambda _client: setattr(worker, "is_watched", bool(server.get_clients())))
            worker.start()
            self._page.tab(TAB)

    def told(self, answer: dict[str, Any]) -> None:  # noqa: ARG002
        """Show how the robot stands."""
        desk = None if self._worker is None else self._worker.desk
        if desk is None or not self._is_robot:
            return
        if desk is not self._shown:
            self._build(desk)
        if self._handles is not None and self._controls is not None:
            self._handles.show(desk.standing)
            self._controls.show(desk.standing, time.perf_counter())

    def away(self, reason: str) -> None:  # noqa: ARG002
        """Nobody answers: there is nothing to take hold of."""
        if self._shown is not None:
            self._shown.lose()
        if self._handles is not None and self._controls is not None:
            self._handles.show(None)
            self._controls.show(None, time.perf_counter())

    def close(self) -> None:
        """Drive no more."""
        if self._worker is not None:
            self._worker.close()

    def _build(self, desk: Desk) -> None:
        page, worker = self._page, self._worker
        assert page is not None
        assert worker is not None
        if self._controls is not None:
            self._controls.remove()
        self._shown = desk
        self._handles = Handles(page.server.scene, page.root, desk)
        self._controls = Controls(page.server.gui, lambda: page.tab(TAB), desk, self._handles, worker.stop)
