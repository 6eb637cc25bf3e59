"""The frames of the scene in a recording: in order, and at any time."""

from __future__ import annotations

from collections.abc import Iterator

from cellwright.errors import MessageError, RecordingError
from cellwright.recording.format import FRAME
from cellwright.recording.reader import RecordedMessage, Recording
from cellwright.scene.frame import Frame, decode, is_whole

BACK = 5_000_000_000
"""So far back [ns] a whole frame is looked for; there is one a second."""


def frames(recording: Recording, *, start: int | None = None, until: int | None = None) -> Iterator[Frame]:
    """The frames from a time on and before another [ns], in order.

    Raises:
        RecordingError: the file is damaged.
    """
    before: Frame | None = None
    begin = None if start is None else start - BACK
    for message in recording.messages([FRAME], start=begin, until=until):
        data = recording.content(message)
        if before is None and not is_whole(data):
            continue  # it begins in the middle of a second
        try:
            before = decode(data, before)
        except MessageError as error:
            raise RecordingError(f"{recording.path}: at {message.time / 1e9:.3f} s: {error}") from None
        if start is None or message.time >= start:
            yield before


def frame_at(recording: Recording, time: int) -> Frame | None:
    """The newest frame at or before a time [ns]; None before the first one.

    Raises:
        RecordingError: the file is damaged.
    """
    found = None
    waiting: list[RecordedMessage] = []
    for message in recording.messages([FRAME], start=time - BACK, until=time + 1):
        if is_whole(recording.content(message)):
            waiting.clear()
        waiting.append(message)
    try:
        for message in waiting:
            found = decode(recording.content(message), found)
    except MessageError as error:
        raise RecordingError(f"{recording.path}: at {time / 1e9:.3f} s: {error}") from None
    return found
