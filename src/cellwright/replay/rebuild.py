"""Making a cell or a robot again from what a recording carries."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from cellwright.errors import RecordingError
from cellwright.recording.reader import Recording
from cellwright.replay.rebuilt import Rebuilt


@contextmanager
def rebuild(recording: Recording) -> Iterator[Rebuilt]:
    raise RecordingError("later")
    yield
