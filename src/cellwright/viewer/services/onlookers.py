"""All services for those who look on, offered wherever something is served."""

from __future__ import annotations

from cellwright.middleware.bus.served import Served
from cellwright.middleware.server import Server
from cellwright.viewer.services.control import Control
from cellwright.viewer.services.names import FOR_ONLOOKERS
from cellwright.viewer.services.panel import Tell, offer_panel
from cellwright.viewer.services.scene import SceneServices

ITS_OWN_PAGE = "a competition shows itself to its own page alone: start it with --view, or in development mode (-d)"
"""Why others are told nothing."""


def offer(server: Server, served: Served, tell: Tell, control: Control) -> None:
    """Answer those who look on. Nothing is made or kept before somebody asks.

    In a competition that is the server's own page, which has its key: the pose of every part, and time that stands
    when one likes, are nothing that a program of the original was given.

    Args:
        server: where to answer.
        served: a cell, a robot's node, or a recording.
        tell: tells what its panel shows.
        control: lets them say how its time passes.
    """
    SceneServices(served).offer(server)
    offer_panel(server, tell, control)
    if served.in_competition:
        server.guard(FOR_ONLOOKERS, ITS_OWN_PAGE)
