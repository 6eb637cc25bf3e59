"""Scene service, frame service with sensor and contact overlays, and registration of all viewer services.

Both answer in JSON and bytes:

- `cellwright/scene`: JSON with the SHA-256 `digest` of the bytes, and `about`, see `ViewedNode.scene_metadata`; bytes
  of `encode_scene`.
- `cellwright/frame`: JSON with `sequence`, `tick`, `run` and the scene's `digest`; bytes of `SceneFrame.encode`, whole.
- `cellwright/frame` with `since`, a `sequence`: bytes with the changes since that frame if it is recent; else whole.
- `cellwright/frame` with `sensors` true: also `sensors`, see `ViewedNode.sensor_overlay`.
- `cellwright/frame` with `contacts` true: also `contacts`, see `contact_forces`.
- `cellwright/frame` with `ahead`, a number of frames: a stream of them, the first one whole, the others with the
  changes since the one before. Some have `panel`, the answer of the panel service.

Requests leave the state as it is.
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

from cellwright.middleware.bus import Node
from cellwright.middleware.server import Server
from cellwright.middleware.server.streams import MAX_AHEAD
from cellwright.rendering.scene.engine import DrawnNode, SceneCapture
from cellwright.rendering.scene.scene import SceneFrame, encode_scene
from cellwright.util.errors import UsageError
from cellwright.viewer.services.control import Control, PanelSource, offer_panel
from cellwright.viewer.services.frame_stream import FrameStream, StreamedFrames
from cellwright.viewer.services.names import FRAME, SCENE, VIEWER_SERVICES

MAX_CONTACTS = 300  # the strongest
HISTORY_LENGTH = 8  # for `since`: enough for several pages, each with one request at a time
_MIN_FORCE = 1e-3  # [N]
ITS_OWN_PAGE = (
    "viewer services of a competition are for its own page only; start it with --view, or in development mode (-d)"
)


class ViewedNode(DrawnNode, Protocol):
    """Cell or robot node that describes its sensors and tools for viewers."""

    def scene_metadata(self, body_index: Callable[[int], int]) -> dict[str, Any]:
        """Constants of the scene: `kind`, `sensors` as in `Sensor.describe`, `tools` as [body, [x, y, z]].

        `body_index` maps a body id of the engine to its index in `Scene.bodies`; 0 for static bodies.
        """
        ...

    def sensor_overlay(self) -> dict[str, Any]:
        """Readings of the sensors by name, as in `Sensor.overlay`; None for one that is off."""
        ...


def contact_forces(served: Node) -> list[list[float]]:
    """Contacts of the last step, [x, y, z, fx, fy, fz], points [m] and forces [N] in the world; the strongest first."""
    model, data = served.simulation.model, served.simulation.data
    found: list[tuple[float, list[float]]] = []
    force = np.empty(6)
    for number in range(data.ncon):
        mujoco.mj_contactForce(model, data, number, force)
        contact = data.contact[number]
        strength = float(np.linalg.norm(force[:3]))
        if strength > _MIN_FORCE and math.isfinite(strength):
            world = contact.frame.reshape(3, 3).T @ force[:3]
            found.append((strength, [round(value, 4) for value in (*contact.pos.tolist(), *world.tolist())]))
    found.sort(key=lambda each: -each[0])
    return [row for _, row in found[:MAX_CONTACTS]]


class SceneSource(Protocol):
    """Source of a scene and its frames: a simulation or a recording."""

    @property
    def scene(self) -> bytes:
        """Encoded scene. It stays the same."""
        ...

    def metadata(self) -> dict[str, Any]:
        """Constants of the scene; see `ViewedNode.scene_metadata`."""
        ...

    def frame(self) -> SceneFrame:
        """Current poses of the bodies."""
        ...

    def details(self, request: dict[str, Any]) -> dict[str, Any]:
        """`tick`, `run` and the requested overlays, at the time of the newest frame."""
        ...


class ServedScene:
    """Scene of a cell or robot node."""

    def __init__(self, served: ViewedNode) -> None:
        self._served = served

    @cached_property
    def scene(self) -> bytes:
        """See `SceneSource`."""
        return encode_scene(self._capture.scene)

    def metadata(self) -> dict[str, Any]:
        """See `SceneSource`."""
        return self._served.scene_metadata(self._capture.index)

    def frame(self) -> SceneFrame:
        """See `SceneSource`."""
        simulation = self._served.simulation
        simulation.refresh()
        return self._capture.frame(simulation.data, simulation.now)

    def details(self, request: dict[str, Any]) -> dict[str, Any]:
        """See `SceneSource`."""
        simulation = self._served.simulation
        found: dict[str, Any] = {"tick": simulation.clock.tick, "run": simulation.runs}
        if request.get("contacts") is True:
            found["contacts"] = contact_forces(self._served)
        if request.get("sensors") is True:
            found["sensors"] = self._served.sensor_overlay()
        return found

    @cached_property
    def _capture(self) -> SceneCapture:
        """Made for the first request: most simulations have no viewer."""
        return SceneCapture.of(self._served)


class SceneServices:
    """Scene and frame service.

    All pages share the newest frames, each with a sequence number. A page that names its frame gets the changes since.
    The numbers start at random, so that those of another server are unknown here.

    Args:
        source: the scene and its frames.
        panel: the panel service, for streams; None if there is none.
    """

    def __init__(self, source: SceneSource, panel: PanelSource | None = None) -> None:
        self._source = source
        self._history: deque[tuple[int, SceneFrame]] = deque(maxlen=HISTORY_LENGTH)
        self._sequence = secrets.randbits(31)
        self._streamed = StreamedFrames(self._newest, self._details, panel)

    def offer(self, server: Server) -> None:
        """Offer both services on a server."""
        server.offer(SCENE, self.scene)
        server.offer(FRAME, self.frame_or_stream)

    def scene(self, _request: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
        """Answer of the scene service."""
        return {"digest": self._digest, "about": self._source.metadata()}, self._source.scene

    def frame(self, request: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
        """Answer of the frame service."""
        frame = self._newest()[1]
        since = request.get("since")
        before = next((kept for sequence, kept in self._history if sequence == since), None)
        return self._details(request), frame.encode(before)

    def frame_or_stream(self, request: dict[str, Any]) -> tuple[dict[str, Any], bytes] | FrameStream:
        """Answer of the frame service, or a stream for a request with `ahead`.

        Raises:
            UsageError: `ahead` is not a number of frames.
        """
        ahead = request.get("ahead")
        if ahead is None:
            return self.frame(request)
        if isinstance(ahead, bool) or not isinstance(ahead, int) or not 1 <= ahead <= MAX_AHEAD:
            raise UsageError(f"{FRAME}: ahead must be a whole number from 1 to {MAX_AHEAD} (got {ahead!r:.40})")
        return FrameStream(self._streamed, request, ahead)

    def _newest(self) -> tuple[int, SceneFrame]:
        """Return the current frame, with its number."""
        frame = self._source.frame()
        if not self._history or not frame.equals(self._history[-1][1]):
            self._sequence += 1
            self._history.append((self._sequence, frame))
        return self._history[-1]

    def _details(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return the JSON of the answer with the newest frame."""
        return {"sequence": self._sequence, "digest": self._digest, **self._source.details(request)}

    @cached_property
    def _digest(self) -> str:
        return hashlib.sha256(self._source.scene).hexdigest()


def offer_viewer_services(server: Server, served: ViewedNode, panel: PanelSource, control: Control) -> None:
    """Offer all viewer services. Nothing is made or kept before the first request.

    A competition grants them to the server's own page only, which has its key. Part poses and a time that can be paused
    were not available to agents of the original.
    """
    SceneServices(ServedScene(served), offer_panel(server, panel, control)).offer(server)
    if served.in_competition:
        server.guard(VIEWER_SERVICES, ITS_OWN_PAGE)
