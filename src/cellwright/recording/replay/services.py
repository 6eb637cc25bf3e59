"""Viewer services of a recording: as of a cell or a robot, at the playback position.

- `cellwright/scene`: as of a cell, with nothing in `about`.
- `cellwright/frame`: as of a cell; what is not recorded, such as contacts, is left out.
- `cellwright/panel`: `kind` is `recording`; `begin`, `end` and `time` [s]; `of`: what the panel showed then.
- `cellwright/control`: `action` `seek` goes to `time` [s], and `reset` to the start; the rest as of a cell.
"""

import math
from typing import Any

import numpy as np

from cellwright.engine.clock import nanoseconds, seconds
from cellwright.middleware.server import Server
from cellwright.recording.replay.playback import Playing
from cellwright.rendering.scene.scene import Scene, SceneFrame, decode_scene, encode_scene
from cellwright.util.errors import MessageError, RejectedCommandError
from cellwright.viewer.services.control import Control, Reset, offer_panel
from cellwright.viewer.services.scene import SceneServices

KIND = "recording"


class RecordingServices:
    """Viewer services of a recording that is played."""

    def __init__(self, playing: Playing) -> None:
        self._playing = playing
        self._recorded = playing.recorded
        scene = self._recorded.source.scene
        try:
            self._bodies = len(decode_scene(scene or b"").bodies)
        except MessageError:
            # the recording is truncated before the scene, or damaged there
            scene, self._bodies = None, 1
        if scene is None:
            scene = encode_scene(Scene(self._recorded.name, ("world",), (), ()))
        self.scene = scene
        """The encoded scene."""
        self.control = Control(
            playing.rate, reset=Reset(playing.restart), acts={"seek": self._seek, "resume": lambda _: playing.resume()}
        )
        """Control of its time."""

    def offer(self, server: Server) -> None:
        """Offer the services on a server."""
        SceneServices(self, offer_panel(server, self.panel, self.control)).offer(server)

    def metadata(self) -> dict[str, Any]:
        """Return further facts of the scene: none."""
        return {}

    def frame(self) -> SceneFrame:
        """Return the current frame; if it is unknown, all bodies but the world are hidden."""
        frame = self._recorded.cursor.frame()
        if frame is not None and len(frame.poses) == self._bodies:
            return frame
        poses = np.zeros((self._bodies, 7), np.float32)
        poses[:, 3] = 1.0
        return SceneFrame(self._recorded.simulation.now, poses, np.arange(self._bodies) == 0)

    def details(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Return `tick` and `run`; sensors and contacts are not recorded."""
        return {"tick": self._recorded.simulation.clock.tick, "run": self._recorded.cuts}

    def panel(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Return the values of the panel."""
        playing, recorded = self._playing, self._recorded
        return {
            "kind": KIND,
            "name": recorded.name,
            "time": seconds(recorded.simulation.now),
            "begin": seconds(playing.first),
            "end": seconds(playing.last),
            "of": recorded.cursor.panel(),
        }

    def _seek(self, request: dict[str, Any]) -> None:
        time = request.get("time")
        if isinstance(time, bool) or not isinstance(time, int | float) or not math.isfinite(time):
            raise RejectedCommandError(f"time must be a number of seconds (got {time!r:.40})")
        first, last = seconds(self._playing.first), seconds(self._playing.last)
        self._playing.seek(nanoseconds(min(max(time, first), last)))
