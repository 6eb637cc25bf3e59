"""What is to be seen at a moment of a recording: whole frames once a second, and changes between them."""

from __future__ import annotations

import json
from typing import Any

from cellwright.errors import MessageError
from cellwright.replay.source import FRAME, PANEL, Entry, Source
from cellwright.scene.frame import Frame, decode, is_whole
from cellwright.simulation.clock import NANOSECONDS

_BACK = 2 * NANOSECONDS  # so far back a whole frame is looked for first [ns]


class Sight:
    """The frame and the panel of the moment at which playing stands.

    Frames are kept as bytes and read when somebody asks: a recording that is played fast shows few of them.

    Args:
        source: what is played.
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self._waiting: list[bytes] = []
        self._frame: Frame | None = None
        self._panel = b""

    def take(self, entry: Entry) -> None:
        """Take the next frame, or what the panel shows from now on."""
        if entry.channel == PANEL:
            self._panel = entry.data
        elif is_whole(entry.data):
            self._waiting = [entry.data]
        else:
            self._waiting.append(entry.data)

    def seek(self, time: int) -> None:
        """Show what was to be seen at `time` [ns]."""
        self._frame, self._waiting = None, []
        back = _BACK
        while True:
            start = max(self._source.begin, time - back)
            frames = []
            for entry in self._source.entries((FRAME,), start):
                if entry.time > time:
                    break
                frames.append(entry)
            if start <= self._source.begin or any(is_whole(entry.data) for entry in frames):
                break
            back *= 4
        for entry in frames:
            self.take(entry)
        panel = self._source.newest(PANEL, time)
        self._panel = b"" if panel is None else panel.data

    def frame(self) -> Frame | None:
        """Where the bodies are; None as long as that is not known."""
        for data in self._waiting:
            try:
                self._frame = decode(data, self._frame)
            except MessageError:  # the file was damaged here: what was seen before stays until the next whole one
                continue
        self._waiting = []
        return self._frame

    def panel(self) -> dict[str, Any]:
        """What the panel shows; empty as long as that is not known."""
        try:
            found = json.loads(self._panel) if self._panel else {}
        except (ValueError, RecursionError):
            found = {}
        return found if isinstance(found, dict) else {}
