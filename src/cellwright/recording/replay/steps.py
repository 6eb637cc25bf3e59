"""What running again has to go by, in the order in which it was recorded."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, TypeAlias

from cellwright.middleware.messages import from_cdr
from cellwright.middleware.messages.standard import String
from cellwright.recording.format.commands import Command
from cellwright.recording.format.format import COMMAND, FRAME, STATE_HASH
from cellwright.recording.format.frames import frame_bytes
from cellwright.recording.format.reader import RecordedMessage
from cellwright.recording.replay.source import Source
from cellwright.rendering.scene.frame import Frame, decode
from cellwright.util.errors import MessageError, RecordingError

_NEVER = 1 << 62


@dataclass(frozen=True, slots=True)
class HashPoint:
    """What the whole state came to at a tick."""

    tick: int
    hash: str


Step: TypeAlias = Command | HashPoint | Frame


def steps(source: Source) -> Iterator[Step]:
    """Commands, state hashes and frames.

    Raises:
        RecordingError: the recording does not hold what it should.
    """
    before: Frame | None = None
    for message in source.messages((COMMAND, STATE_HASH, FRAME)):
        if message.topic == FRAME:
            try:
                before = decode(frame_bytes(message.data), before)
            except MessageError as error:
                raise _senseless(message, error) from None
            yield before
        elif message.topic == COMMAND:
            yield Command.decode(_text(message))
        else:
            yield _hash_point(message)


def _hash_point(message: RecordedMessage) -> HashPoint:
    try:
        told: dict[str, Any] = json.loads(_text(message))
        tick, digest = told["tick"], told["hash"]
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise _senseless(message, error) from None
    if type(tick) is not int or not 0 <= tick < _NEVER or not isinstance(digest, str):
        raise _senseless(message, "a tick and a hash are needed")
    return HashPoint(tick, digest)


def _text(message: RecordedMessage) -> str:
    try:
        return from_cdr(message.data, String).data
    except MessageError as error:
        raise _senseless(message, error) from None


def _senseless(message: RecordedMessage, why: object) -> RecordingError:
    return RecordingError(f"{message.topic} at {message.time / 1e9:.3f} s makes no sense: {why}")
