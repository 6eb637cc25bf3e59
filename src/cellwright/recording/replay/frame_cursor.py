"""Frame cursor: frame and panel at the playback position."""

from typing import Any

from cellwright.engine.clock import NANOSECONDS
from cellwright.recording.format.format import FRAME, PANEL
from cellwright.recording.format.reader import RecordedMessage, RecordingFile, frame_bytes, json_object
from cellwright.rendering.scene.scene import SceneFrame, decode_frame, is_whole_frame
from cellwright.util.errors import MessageError

_SEARCH_RANGE = 2 * NANOSECONDS  # first range of the search for a whole frame [ns]


class FrameCursor:
    """Frame and panel at the playback position.

    Frames are kept as bytes and decoded on request: fast playback shows few of them.
    """

    def __init__(self, source: RecordingFile) -> None:
        self._source = source
        self._waiting: list[bytes] = []
        self._frame: SceneFrame | None = None
        self._panel = b""

    def take(self, message: RecordedMessage) -> None:
        """Take the next frame, or the next values of the panel."""
        if message.topic == PANEL:
            self._panel = message.data
            return
        frame = frame_bytes(message.data)
        if is_whole_frame(frame):
            self._waiting = [frame]
        else:
            self._waiting.append(frame)

    def seek(self, time: int) -> None:
        """Go to `time` [ns]."""
        self._frame, self._waiting = None, []
        back = _SEARCH_RANGE
        while True:
            start = max(self._source.begin, time - back)
            frames = list(self._source.messages((FRAME,), start=start, until=time + 1))
            if start <= self._source.begin or any(is_whole_frame(frame_bytes(each.data)) for each in frames):
                break
            # Frames hold changes to the one before, so the search goes back to a whole frame.
            back *= 4
        for each in frames:
            self.take(each)
        panel = self._source.newest(PANEL, time)
        self._panel = b"" if panel is None else panel.data

    def frame(self) -> SceneFrame | None:
        """Return the frame; None as long as it is not known."""
        for data in self._waiting:
            try:
                self._frame = decode_frame(data, self._frame)
            except MessageError:
                # damaged: the frame before stays until the next whole one
                continue
        self._waiting = []
        return self._frame

    def panel(self) -> dict[str, Any]:
        """Return the values of the panel; empty as long as they are not known."""
        try:
            return json_object(self._panel) if self._panel else {}
        except MessageError:
            return {}
