"""All services for those who look on, offered wherever something is served."""

from __future__ import annotations

from cellwright.bus.served import Served
from cellwright.server.server import Server
from cellwright.server.services.control import Control
from cellwright.server.services.panel import Tell, offer_panel
from cellwright.server.services.scene import SceneServices

PAGE = "/page_"
"""What the names of pages as guests begin with."""


def is_onlooker(node: str) -> bool:
    """Whether a guest of this name looks on, and does not work what is served."""
    return node.startswith(PAGE)


def offer(server: Server, served: Served, tell: Tell, control: Control) -> None:
    """Answer those who look on. Nothing is made or kept before somebody asks.

    Args:
        server: where to answer.
        served: a cell, a robot's node, or a recording.
        tell: tells what its panel shows.
        control: lets them say how its time passes.
    """
    SceneServices(served).offer(server)
    offer_panel(server, tell, control)
