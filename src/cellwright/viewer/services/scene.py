"""What is to be seen, and where it is: for pages, and for whoever else draws what is served.

| service | asked | answer |
|---|---|---|
| `cellwright/scene` | | `scene`: base64 of `encode_scene`; `digest`: their SHA-256; `about`: see `sights.about` |
| `cellwright/frame` | see below | `time` [ns], `tick`, `run`, `digest`; `frame`: base64 of `Frame.encode`, whole |
| | `sensors`: true | `sensors`: see `sights.sensors` |
| | `contacts`: true | `contacts`: see `sights.contacts` |

Nobody is told anything who does not ask, and an answer leaves the state as it is.
"""

from __future__ import annotations

import hashlib
from base64 import b64encode
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from cellwright.middleware.bus.served import Served
from cellwright.middleware.server import Server
from cellwright.rendering.scene.encoded import encode_scene
from cellwright.rendering.scene.taking import SceneTaker
from cellwright.viewer.services import sights
from cellwright.viewer.services.names import FRAME, SCENE


@dataclass(frozen=True)
class _Taken:
    """A scene as it is told."""

    taker: SceneTaker
    text: str
    digest: str


class SceneServices:
    """Tells what is to be seen of what is served.

    Args:
        served: a cell, a robot's node, or a recording.
    """

    def __init__(self, served: Served) -> None:
        self._served = served

    def offer(self, server: Server) -> None:
        """Answer on a server."""
        server.offer(SCENE, self.scene)
        server.offer(FRAME, self.frame)

    def scene(self, _asked: dict[str, Any]) -> dict[str, Any]:
        """What there is to be seen."""
        taken = self._taken
        return {"scene": taken.text, "digest": taken.digest, "about": sights.about(self._served, taken.taker)}

    def frame(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Where it is now."""
        simulation = self._served.simulation
        simulation.refresh()
        frame = self._taken.taker.frame(simulation.data, simulation.now)
        extras: dict[str, Any] = {}
        if asked.get("contacts") is True:
            extras["contacts"] = sights.contacts(self._served)
        if asked.get("sensors") is True:
            extras["sensors"] = sights.sensors(self._served)
        return extras | {
            "time": simulation.now,
            "tick": simulation.clock.tick,
            "run": simulation.runs,
            "digest": self._taken.digest,
            "frame": b64encode(frame.encode()).decode(),
        }

    @cached_property
    def _taken(self) -> _Taken:
        """Made when somebody asks for the first time: most that is served is never looked at."""
        taker = SceneTaker(self._served.simulation.model, name=self._served.name, hidden=self._served.out_of_sight)
        data = encode_scene(taker.scene)
        return _Taken(taker, b64encode(data).decode(), hashlib.sha256(data).hexdigest())
