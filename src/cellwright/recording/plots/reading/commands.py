"""When commands came, by the name of their topic or service."""

from __future__ import annotations

import json
import re
from contextlib import suppress

import numpy as np

from cellwright.recording.format.format import COMMAND
from cellwright.recording.format.reader import RecordedMessage
from cellwright.recording.plots.reading.reader import SECOND
from cellwright.recording.plots.tracks import CommandTrack
from cellwright.util.errors import showable

_LONGEST = 200  # characters of a name
_NAME = re.compile(rb'"name": ?"((?:[^"\\]|\\.){1,200})"')


class Commands:
    """Reads names and times alone: what was commanded may be long."""

    topics = (COMMAND,)

    def __init__(self) -> None:
        self._times: dict[str, list[float]] = {}

    def take(self, message: RecordedMessage) -> None:
        """Take the next command."""
        if found := _NAME.search(message.data):
            self._times.setdefault(_plain(found[1]), []).append(message.time / SECOND)

    def tracks(self) -> list[CommandTrack]:
        """Those of each name, in the order in which they came first."""
        return [CommandTrack(name, np.array(times)) for name, times in self._times.items()]


def _plain(name: bytes) -> str:
    """A name as JSON writes it, in plain text that can be shown."""
    text = name.decode(errors="replace")
    with suppress(ValueError):
        text = str(json.loads(f'"{text}"'))
    return showable(text, _LONGEST)
