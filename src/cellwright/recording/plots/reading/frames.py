"""Where a body of the scene was, from the frames of it."""

from __future__ import annotations

import numpy as np

from cellwright.recording.format.format import FRAME
from cellwright.recording.format.frames import frame_bytes
from cellwright.recording.format.reader import RecordedMessage
from cellwright.recording.plots.reading.reader import SECOND
from cellwright.recording.plots.tracks import ToolTrack
from cellwright.rendering.scene.encoded import decode_scene
from cellwright.rendering.scene.frame import Frame, decode
from cellwright.util.errors import MessageError


class BodyPath:
    """Reads the path of one body.

    Args:
        scene: the scene, encoded.
        body: name of the body.
    """

    topics = (FRAME,)

    def __init__(self, scene: bytes | None, body: str) -> None:
        try:
            bodies = () if scene is None else decode_scene(scene).bodies
        except MessageError:
            bodies = ()
        self._body = bodies.index(body) if body in bodies else -1
        self._frame: Frame | None = None
        self._rows: list[tuple[float, float, float, float]] = []

    def take(self, message: RecordedMessage) -> None:
        """Take the next frame."""
        if self._body < 0:
            return
        self._frame = decode(frame_bytes(message.data), self._frame)
        if self._body < len(self._frame.poses):
            x, y, z = self._frame.poses[self._body, :3].tolist()
            self._rows.append((message.time / SECOND, x, y, z))

    def track(self, name: str) -> ToolTrack:
        """The path, under a name."""
        rows = np.array(self._rows).reshape(-1, 4)
        return ToolTrack(name, "world", rows[:, 0], rows[:, 1:])
