"""Channel from a process of an evaluation to the one that started it: lines of JSON through its standard streams.

A worker signs its lines with a key that came with its order, and the evaluation checks signature, form and bounds of
each. A program in the worker's process can find the key in its memory. One in a process of its own cannot.
"""

import hmac
import json
import os
import threading
from collections.abc import Iterator
from typing import IO, Annotated, Any, TextIO

import msgspec
from msgspec import Meta, Struct

from cellwright.running.run import Outcome
from cellwright.util.errors import CellwrightError, printable

_MAX_LINE = 64 << 20  # bytes; a scene with large meshes of a user has some
_MAX_RESULT = 8 << 20  # bytes
_MAX_NUMBER = 1e9  # points, and seconds of thirty years
_MAX_ERROR = 1 << 20  # characters
_SIGNATURE = 32  # hexadecimal digits

_Amount = Annotated[float, Meta(ge=0.0, le=_MAX_NUMBER)]
_Word = Annotated[str, Meta(pattern=f"^({'|'.join(outcome.name.lower() for outcome in Outcome)})$")]
_Hash = Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]
_Error = Annotated[str, Meta(max_length=_MAX_ERROR)]


_sending = threading.RLock()


class Progress(Struct, frozen=True, forbid_unknown_fields=True):
    """Simulation time [s] of a run so far, and its points."""

    time: _Amount
    points: _Amount


class Report(Struct, frozen=True, forbid_unknown_fields=True):
    """Report of a run that is over; its fields are those of `Result`, and `error` is the error with its traceback."""

    outcome: _Word
    points: _Amount
    wall: _Amount
    simulated: _Amount
    steps: Annotated[int, Meta(ge=0, le=1 << 53)]
    success: bool | None
    state_hash: _Hash
    score: dict[str, Any]
    timeline: dict[str, Any]
    error: _Error


class Message(Struct, frozen=True, forbid_unknown_fields=True):
    """Line of a worker, of which one field is set.

    Attributes:
        begun: the process has begun, and this is its id.
        progress: progress of the run.
        scene: its scene, as base64.
        frame: its state, as base64.
        refused: reason why the agent cannot be made, or the recording not be played.
        kills: the program sends its own process a signal.
        made: the agent could be made.
        result: the report of the run.
    """

    begun: Annotated[int, Meta(ge=0)] | None = None
    progress: Progress | None = None
    scene: str | None = None
    frame: str | None = None
    refused: _Error | None = None
    kills: bool | None = None
    made: bool | None = None
    result: Report | None = None


class ChannelError(CellwrightError):
    """A line is no message of a worker."""


class SignedChannel:
    """Channel of a worker; several threads may send.

    Args:
        stream: the stream to the evaluation.
        key: the key of the order.
    """

    def __init__(self, stream: TextIO, key: str) -> None:
        self._stream = stream
        self._key = key.encode()

    def send(self, kind: str, content: object) -> None:
        """Send a message with one field."""
        text = json.dumps({kind: content}, allow_nan=False)
        with _sending:
            self._stream.write(f"{_sign(self._key, text.encode())} {text}\n")
            self._stream.flush()

    def send_at_once(self, kind: str, content: object) -> None:
        """Send a short message that bypasses the buffer; the process is about to end."""
        text = json.dumps({kind: content})
        # a fork may have been made while another thread held it
        is_mine = _sending.acquire(timeout=1.0)
        try:
            os.write(self._stream.fileno(), f"{_sign(self._key, text.encode())} {text}\n".encode())
        finally:
            if is_mine:
                _sending.release()


def read_messages(stream: IO[bytes], key: str) -> Iterator[Message]:
    """Yield the messages of a worker until its stream ends, if need be within a line.

    Raises:
        ChannelError: a line has no valid signature, or is no message.
    """
    secret = key.encode()
    for line in iter(lambda: stream.readline(_MAX_LINE), b""):
        if line.endswith(b"\n"):
            yield _message(line[:-1], secret)
        elif len(line) == _MAX_LINE:
            raise ChannelError(f"a line is longer than {_MAX_LINE >> 20} MiB")


def _message(line: bytes, key: bytes) -> Message:
    text = line[_SIGNATURE + 1 :]
    if not hmac.compare_digest(line[: _SIGNATURE + 1], f"{_sign(key, text)} ".encode()):
        raise ChannelError("a line is not signed by the worker")
    try:
        message = msgspec.json.decode(text, type=Message)
    except (msgspec.MsgspecError, RecursionError) as error:
        raise ChannelError(printable(str(error), 200)) from None
    if sum(getattr(message, name) is not None for name in Message.__struct_fields__) != 1:
        raise ChannelError("a line must have one field")
    if message.result is not None and len(line) > _MAX_RESULT:
        raise ChannelError(f"a result is longer than {_MAX_RESULT >> 20} MiB")
    return message


def _sign(key: bytes, text: bytes) -> str:
    return hmac.digest(key, text, "sha256").hex()[:_SIGNATURE]
