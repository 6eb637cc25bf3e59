"""The service `cellwright/panel`: what a panel shows of whatever is served, and how its time passes.

What a cell tells stands in `cell_panel`, what a robot tells in `robot_panel`; beside it `control` has the state that
`cellwright/control` answers with.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cellwright.middleware.server import Server
from cellwright.viewer.services.control import Control
from cellwright.viewer.services.names import PANEL

Tell = Callable[[dict[str, Any]], dict[str, Any]]
"""Tells what a panel shows, as JSON values; takes what was asked."""


def offer_panel(server: Server, tell: Tell, control: Control) -> None:
    """Offer a panel and the control of time on a server."""
    server.offer(PANEL, lambda asked: {**tell(asked), "control": control.state()})
    control.offer(server)
