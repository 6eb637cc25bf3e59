"""Scene service, frame service with sensor and contact overlays, and the offer of all services for viewers.

Both answer in JSON and bytes:

| service | request | JSON | bytes |
|---|---|---|---|
| `cellwright/scene` | | `digest`: SHA-256 of the bytes; `about`: see `ViewedNode.scene_metadata` | `encode_scene` |
| `cellwright/frame` | see below | `sequence`, `tick`, `run`, `digest` of the scene | `Frame.encode`, whole |
| | `since`: a `sequence` | | changes since that frame, where it is one of the newest; else whole |
| | `sensors`: true | `sensors`: see `ViewedNode.sensor_overlay` | |
| | `contacts`: true | `contacts`: see `contact_forces` | |

An answer holds what was asked for, and leaves the state as it is.
"""

import hashlib
import math
import secrets
from collections import deque
from collections.abc import Callable
from functools import cached_property
from typing import Any, Protocol

import mujoco
import numpy as np

from cellwright.middleware.bus import Served
from cellwright.middleware.server import Server
from cellwright.rendering.scene.engine import SceneTaker
from cellwright.rendering.scene.scene import Frame, encode_scene
from cellwright.viewer.services.control import Control, Tell, offer_panel
from cellwright.viewer.services.names import FOR_ONLOOKERS, FRAME, SCENE

MOST_CONTACTS = 300  # that are told, the strongest first
HISTORY_LENGTH = 8  # frames that are kept for `since`: enough for several pages, each with one request at a time
_WEAKEST = 1e-3  # [N]


class ViewedNode(Served, Protocol):
    """A cell or a robot's node, which says itself what there is to draw beside its scene."""

    def scene_metadata(self, body_index: Callable[[int], int]) -> dict[str, Any]:
        """What stays as it is: `kind`, `sensors` as in `Sensor.describe`, `tools` as [body, [x, y, z]].

        `body_index` gives the index in `Scene.bodies`, 0 for what stands still, for an id of the engine.
        """
        ...

    def sensor_overlay(self) -> dict[str, Any]:
        """What the sensors find now, by name, as in `Sensor.overlay`; None for one that is switched off."""
        ...


def contact_forces(served: Served) -> list[list[float]]:
    """Where things touched in the last step: [x, y, z, fx, fy, fz], places [m] and forces [N] in the world."""
    model, data = served.simulation.model, served.simulation.data
    found: list[tuple[float, list[float]]] = []
    force = np.empty(6)
    for number in range(data.ncon):
        mujoco.mj_contactForce(model, data, number, force)
        contact = data.contact[number]
        strength = float(np.linalg.norm(force[:3]))
        if strength > _WEAKEST and math.isfinite(strength):
            world = contact.frame.reshape(3, 3).T @ force[:3]
            found.append((strength, [round(value, 4) for value in (*contact.pos.tolist(), *world.tolist())]))
    found.sort(key=lambda each: -each[0])
    return [row for _, row in found[:MOST_CONTACTS]]


class SceneSource(Protocol):
    """Something to be seen: a simulation, or a recording of one."""

    @property
    def scene(self) -> bytes:
        """The scene, encoded. It stays the same."""
        ...

    def metadata(self) -> dict[str, Any]:
        """What else is known of the scene; see `ViewedNode.scene_metadata`."""
        ...

    def frame(self) -> Frame:
        """Where the bodies are now."""
        ...

    def details(self, asked: dict[str, Any]) -> dict[str, Any]:
        """`tick`, `run`, and the overlays that a request asks for, of the moment of the newest frame."""
        ...


class ServedScene:
    """Scene of a cell or of a robot's node."""

    def __init__(self, served: ViewedNode) -> None:
        self._served = served

    @cached_property
    def scene(self) -> bytes:
        """See `SceneSource`."""
        return encode_scene(self._taker.scene)

    def metadata(self) -> dict[str, Any]:
        """See `SceneSource`."""
        return self._served.scene_metadata(self._taker.index)

    def frame(self) -> Frame:
        """See `SceneSource`."""
        simulation = self._served.simulation
        simulation.refresh()
        return self._taker.frame(simulation.data, simulation.now)

    def details(self, asked: dict[str, Any]) -> dict[str, Any]:
        """See `SceneSource`."""
        simulation = self._served.simulation
        found: dict[str, Any] = {"tick": simulation.clock.tick, "run": simulation.runs}
        if asked.get("contacts") is True:
            found["contacts"] = contact_forces(self._served)
        if asked.get("sensors") is True:
            found["sensors"] = self._served.sensor_overlay()
        return found

    @cached_property
    def _taker(self) -> SceneTaker:
        """Made for the first request: most simulations are never looked at."""
        return SceneTaker(self._served.simulation.model, name=self._served.name, hidden=self._served.out_of_sight)


class SceneServices:
    """Answers what there is to be seen, and where it is.

    The newest frames are kept for all pages together, each with a sequence number: a page that names the frame it has
    gets what changed since. Numbers begin anywhere, so that those of another server are unknown here.
    """

    def __init__(self, source: SceneSource) -> None:
        self._source = source
        self._history: deque[tuple[int, Frame]] = deque(maxlen=HISTORY_LENGTH)
        self._sequence = secrets.randbits(31)

    def offer(self, server: Server) -> None:
        """Answer on a server."""
        server.offer(SCENE, self.scene)
        server.offer(FRAME, self.frame)

    def scene(self, _asked: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
        """What there is to be seen."""
        return {"digest": self._digest, "about": self._source.metadata()}, self._source.scene

    def frame(self, asked: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
        """Where it is now."""
        frame = self._source.frame()
        if not self._history or not frame.equals(self._history[-1][1]):
            self._sequence += 1
            self._history.append((self._sequence, frame))
        since = asked.get("since")
        before = next((kept for sequence, kept in self._history if sequence == since), None)
        said = {"sequence": self._sequence, "digest": self._digest, **self._source.details(asked)}
        return said, frame.encode(before)

    @cached_property
    def _digest(self) -> str:
        return hashlib.sha256(self._source.scene).hexdigest()


ITS_OWN_PAGE = "a competition shows itself to its own page alone: start it with --view, or in development mode (-d)"


def offer_viewer_services(server: Server, served: ViewedNode, tell: Tell, control: Control) -> None:
    """Answer those who look on. Nothing is made or kept before somebody asks.

    In a competition that is the server's own page, which has its key: the pose of every part, and time that stands
    when one likes, are nothing that a program of the original was given.
    """
    SceneServices(ServedScene(served)).offer(server)
    offer_panel(server, tell, control)
    if served.in_competition:
        server.guard(FOR_ONLOOKERS, ITS_OWN_PAGE)
