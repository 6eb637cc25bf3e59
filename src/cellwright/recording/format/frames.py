"""The frames of the scene in a recording."""

from __future__ import annotations

from collections.abc import Iterator

from cellwright.middleware.messages import from_cdr
from cellwright.middleware.messages.standard import UInt8MultiArray
from cellwright.recording.format.format import FRAME
from cellwright.recording.format.reader import Recording
from cellwright.rendering.scene.frame import Frame, decode, is_whole
from cellwright.util.errors import MessageError, RecordingError

BACK = 5_000_000_000
"""So far back [ns] a whole frame is looked for; there is one a second."""


def frames(recording: Recording, *, start: int | None = None, until: int | None = None) -> Iterator[Frame]:
    """The frames from a time on and before another [ns], in order. Changes to a frame that was cut off are left out.

    Raises:
        RecordingError: the file is damaged.
    """
    before: Frame | None = None
    begin = None if start is None else start - BACK
    for message in recording.messages([FRAME], start=begin, until=until):
        data = frame_bytes(message.data)
        if before is None and not is_whole(data):
            continue  # it begins in the middle of a second
        try:
            before = decode(data, before)
        except MessageError as error:
            raise RecordingError(f"{recording.path}: {FRAME} at {message.time / 1e9:.3f} s: {error}") from None
        if start is None or message.time >= start:
            yield before


def frame_bytes(data: bytes) -> bytes:
    """The bytes of a frame in the message that carries it, CDR; none where it is no such message."""
    try:
        return from_cdr(data, UInt8MultiArray).data.tobytes()
    except MessageError:
        return b""
