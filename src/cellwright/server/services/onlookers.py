"""All services for those who look on, offered wherever something is served."""

from __future__ import annotations

from cellwright.bus.served import Served
from cellwright.server.server import Server
from cellwright.server.services.scene import SceneServices


def offer(server: Server, served: Served) -> None:
    """Answer those who look on. Nothing is made or kept before somebody asks."""
    SceneServices(served).offer(server)
