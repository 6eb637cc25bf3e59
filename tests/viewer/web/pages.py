"""Page for features, over a real viser, and a connection that records its requests."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import viser

from cellwright.util.errors import RejectedCommandError


class NotingLink:
    """Fake connection to the server."""

    def __init__(self) -> None:
        self.welcome: dict[str, Any] = {"timestep": [1, 500]}
        self.requests: list[dict[str, Any]] = []
        self.called: list[tuple[str, Any]] = []
        self.refuses = ""
        """Reason to refuse all requests; empty to accept them."""
        self.succeeds = True

    def ask(self, service: str, **request: Any) -> dict[str, Any]:
        if self.refuses:
            raise RejectedCommandError(self.refuses)
        self.requests.append(request)
        return {}

    def call(self, service: str, request: Any) -> Any:
        if self.refuses:
            raise RejectedCommandError(self.refuses)
        self.called.append((service, request))
        return SimpleNamespace(success=self.succeeds, message="")


class StubPage:
    """Page, as far as features use it; its notifications are in `notices`."""

    def __init__(self, server: viser.ViserServer, panel: dict[str, Any]) -> None:
        self.server, self.link, self.scene = server, NotingLink(), None
        self.first_panel = panel
        self.notices: list[tuple[str, str]] = []
        self.tabs: list[str] = []
        self._group = server.gui.add_tab_group()

    def tab(self, name: str) -> Any:
        self.tabs.append(name)
        return self._group.add_tab(name)

    def notify(self, title: str, text: str, *, is_bad: bool = False) -> None:
        assert is_bad
        self.notices.append((title, text))


@contextmanager
def page(panel: dict[str, Any] | None = None) -> Iterator[Any]:
    """Page for the block."""
    server = viser.ViserServer("127.0.0.1", 0, verbose=False)
    try:
        yield StubPage(server, panel or {})
    finally:
        server.stop()


def clicked(handle: Any, value: Any, *, by_browser: bool = True) -> None:
    """Click or move something, as a browser or as the page itself."""
    handle._impl.value = value
    for act in handle._impl.update_cb:
        act(SimpleNamespace(client=object() if by_browser else None, target=handle))
