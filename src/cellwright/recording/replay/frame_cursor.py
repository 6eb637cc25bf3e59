"""Frame cursor: frame and panel at the playback position."""

from typing import Any

from cellwright.engine.clock import NANOSECONDS
from cellwright.recording.format.format import FRAME, PANEL
from cellwright.recording.format.reader import RecordedMessage, Recording, frame_bytes, json_object
from cellwright.rendering.scene.scene import Frame, decode_frame, is_whole_frame
from cellwright.util.errors import MessageError

_BACK = 2 * NANOSECONDS  # so far back a whole frame is looked for first [ns]


class Sight:
    """The frame and the panel of the moment at which playing stands.

    Frames are kept as bytes and read when somebody asks: a recording that is played fast shows few of them.
    """

    def __init__(self, source: Recording) -> None:
        self._source = source
        self._waiting: list[bytes] = []
        self._frame: Frame | None = None
        self._panel = b""

    def take(self, message: RecordedMessage) -> None:
        """Take the next frame, or what the panel shows from now on."""
        if message.topic == PANEL:
            self._panel = message.data
            return
        frame = frame_bytes(message.data)
        if is_whole_frame(frame):
            self._waiting = [frame]
        else:
            self._waiting.append(frame)

    def seek(self, time: int) -> None:
        """Show what was to be seen at `time` [ns]."""
        self._frame, self._waiting = None, []
        back = _BACK
        while True:
            start = max(self._source.begin, time - back)
            frames = list(self._source.messages((FRAME,), start=start, until=time + 1))
            if start <= self._source.begin or any(is_whole_frame(frame_bytes(each.data)) for each in frames):
                break
            back *= 4
        for each in frames:
            self.take(each)
        panel = self._source.newest(PANEL, time)
        self._panel = b"" if panel is None else panel.data

    def frame(self) -> Frame | None:
        """Where the bodies are; None as long as that is not known."""
        for data in self._waiting:
            try:
                self._frame = decode_frame(data, self._frame)
            except MessageError:  # the file was damaged here: what was seen before stays until the next whole one
                continue
        self._waiting = []
        return self._frame

    def panel(self) -> dict[str, Any]:
        """What the panel shows; empty as long as that is not known."""
        try:
            return json_object(self._panel) if self._panel else {}
        except MessageError:
            return {}
