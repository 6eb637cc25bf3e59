"""Frames of the protocol: a kind, a number, three names and bytes, with the length in front.

The client (a program or a bridge) opens with HELLO, and the cell answers WELCOME. From then on:

| client sends | number | name | type | node | payload | answer |
|---|---|---|---|---|---|---|
| HELLO | 0 | | | | JSON, see `hello` | WELCOME, or REFUSED and the end of the connection |
| SUBSCRIBE | its own choice | topic | empty, or `quiet` | publishing node, or empty for all | | DONE |
| UNSUBSCRIBE | of the subscription | | | | | none |
| PUBLISH | its own choice, 0: no answer | topic | message type | on whose behalf | message | DONE |
| CALL | its own choice | service | service type | on whose behalf | request | ANSWER, or see below |
| ADVANCE | its own choice | | | | `advance` | TIME |
| PONG | of the PING, or 0: PING me | | | | | none |

| cell sends | number | name | payload |
|---|---|---|---|
| WELCOME | 0 | | JSON: the cell, its topics and its services |
| MESSAGE | of the subscription | | message |
| DONE | of the request | | |
| ANSWER | of the call | | response |
| DATA | of the call | | response in JSON and bytes, see `data_payload`; from services of the server alone |
| REFUSED | of the request | name of the error's class in `cellwright.util.errors` | the reason, UTF-8; see below |
| TIME | of the request | | simulation time [ns], see `read_time` |
| PING | of the cell's choice, above 0 | | |
| NOTICE | 0 | | a line about what was ignored, limited or held, UTF-8; only to clients that asked for it in HELLO |
| ENDED | 0 | | the reason, UTF-8; nothing follows |

Messages, requests and responses have the encoding that the client named in its HELLO: CDR, ROS 1, or ROS 2, which is
CDR but for the packages in `VALUE_PACKAGES`. The client chooses
the numbers of its connection, and must not reuse one that is in use. An empty node stands for the client's own.
A stream answers one CALL with many DATA. Another CALL with its number asks for more of them, UNSUBSCRIBE ends it.
ADVANCE is for a cell in lockstep, where nothing else advances time. It ends early with a message of a subscription that
is not `quiet`. There an answer may take simulation time: DONE announces this, and ANSWER with the same number follows.

The type of a REFUSED is `SAID` if the cell has reported the refusal to its user, and not only counted it. What
the report added to the reason, as the number of refusals before, stands in its node.

PING measures how far a client is behind: it answers PONG when it has handled all earlier frames. A client requests
PINGs by a PONG of its own. In real time, simulation time stands while such a client is late with its answer, within
the limits of `cellwright.middleware.server.clients`.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Dict, Iterator, Tuple

PROTOCOL = 1
QUIET = "quiet"
"""In place of the type in SUBSCRIBE: the client only records messages and does not react, so time may go on."""
SAID = "said"
"""Type of a REFUSED whose reason was reported."""
VALUE_PACKAGES = ("actionlib_msgs", "control_msgs")
"""Packages whose messages are JSON objects in the encoding `ros2`: their fields differ between distributions."""
ROS2_ONLY = "control_msgs/ParallelGripperCommand"
"""Action that ROS 1 lacks: it has none of its topics there, and packages none of its messages."""
MAX_FRAME_BYTES = 16 << 20  # bytes of the longest frame that is accepted; no message of a cell comes near
MAX_CLIENT_FRAME_BYTES = 3 << 20
"""Bytes of the longest frame that a client may send: the server buffers it, and time stands while it is read."""

_LENGTH = struct.Struct("<I")
_HEAD = struct.Struct("<BIHHH")
_ADVANCE = struct.Struct("<qB")
_TIME = struct.Struct("<q")
_JSON_LENGTH = struct.Struct("<I")


WORLD_CHANGE = "another world is loaded"
"""Reason of an end after which a server with another world follows at the same address."""


class FrameKind(IntEnum):
    """Purpose of a frame."""

    HELLO = 1
    SUBSCRIBE = 2
    UNSUBSCRIBE = 3
    PUBLISH = 4
    CALL = 5
    ADVANCE = 6
    PONG = 7
    WELCOME = 65
    MESSAGE = 66
    DONE = 67
    ANSWER = 68
    REFUSED = 69
    TIME = 70
    ENDED = 71
    PING = 72
    DATA = 73
    NOTICE = 74


class FrameError(Exception):
    """Bytes that are no frame; the rest of their stream is unusable."""


@dataclass(frozen=True)
class Frame:
    """One frame; the tables above describe its fields."""

    kind: FrameKind
    number: int = 0
    name: str = ""
    type: str = ""
    node: str = ""
    payload: bytes = b""

    def encode(self, max_bytes: int = MAX_FRAME_BYTES) -> bytes:
        """Return the frame as bytes, with its length in front.

        Raises:
            FrameError: a number or a name does not fit, or it is longer than `MAX_CLIENT_FRAME_BYTES` from a client.
        """
        name, type_name, node = self.name.encode(), self.type.encode(), self.node.encode()
        try:
            head = _HEAD.pack(self.kind, self.number, len(name), len(type_name), len(node))
        except struct.error as error:
            raise FrameError(f"cannot encode {self.kind.name}: {error}") from None
        rest = b"".join((head, name, type_name, node, self.payload))
        if len(rest) > max_bytes:
            raise FrameError(f"a frame of {len(rest)} bytes is too long (at most {max_bytes})")
        return _LENGTH.pack(len(rest)) + rest

    def json(self) -> Dict[str, Any]:  # noqa: UP006
        """Return the payload as a JSON object; a FrameError if it is none."""
        return self._json_object(self.payload)

    def text(self) -> str:
        """Return the payload as text."""
        return self.payload.decode(errors="replace")

    def data(self) -> Tuple[Dict[str, Any], memoryview]:  # noqa: UP006
        """Return JSON object and bytes of a DATA frame.

        Raises:
            FrameError: it is another kind of frame, or the payload has another form.
        """
        if self.kind is not FrameKind.DATA:
            raise FrameError(f"expected DATA (got {self.kind.name}); use the same version at both ends")
        begin = _JSON_LENGTH.size
        try:
            end = begin + _JSON_LENGTH.unpack_from(self.payload)[0]
        except struct.error:
            end = begin + len(self.payload)
        if end > len(self.payload):
            raise FrameError("the JSON of DATA is longer than its payload")
        return self._json_object(self.payload[begin:end]), memoryview(self.payload)[end:]

    def _json_object(self, text: bytes) -> Dict[str, Any]:  # noqa: UP006
        try:
            value = json.loads(text)
        except (ValueError, RecursionError):
            value = None
        if not isinstance(value, dict):
            raise FrameError(f"the payload of {self.kind.name} is not a JSON object")
        return value


class Decoder:
    """Decoder of frames from pieces of a byte stream."""

    def __init__(self, max_bytes: int = MAX_FRAME_BYTES) -> None:
        # May change at any time; it applies to the frames that begin from then on.
        self.max_bytes = max_bytes
        self._waiting = bytearray()

    @property
    def incomplete_bytes(self) -> int:
        """Bytes of an incomplete frame."""
        return len(self._waiting)

    def feed(self, data: bytes) -> Iterator[Frame]:
        """Add bytes; yield the frames that are complete with them.

        Raises:
            FrameError: these bytes are no frames. Complete frames before them come first.
        """
        waiting = self._waiting
        waiting += data
        position = 0
        try:
            while len(waiting) - position >= _LENGTH.size:
                (length,) = _LENGTH.unpack_from(waiting, position)
                if not _HEAD.size <= length <= self.max_bytes:
                    raise FrameError(f"invalid frame length: {length} bytes")
                begin = position + _LENGTH.size
                if len(waiting) < begin + length:
                    break
                position = begin + length
                yield _decoded(bytes(waiting[begin:position]))
        finally:
            del waiting[:position]


def _decoded(data: bytes) -> Frame:
    kind, number, *lengths = _HEAD.unpack_from(data)
    position = _HEAD.size
    names = []
    for length in lengths:
        names.append(data[position : position + length])
        position += length
    if position > len(data):
        raise FrameError("the names of a frame are longer than the frame")
    try:
        name, type_name, node = (each.decode() for each in names)
        return Frame(FrameKind(kind), number, name, type_name, node, data[position:])
    except ValueError as error:  # an unknown kind, or names that are no UTF-8
        raise FrameError(f"invalid frame: {error}") from None


def hello(node: str, encoding: str, key: str = "", *, notices: bool = False) -> Frame:
    """Return the first frame of a client.

    Args:
        node: name of the client.
        encoding: of messages, `cdr`, `ros1` or `ros2`.
        key: opens services that are guarded; the cell's own page has it.
        notices: asks for NOTICE frames.
    """
    request: Dict[str, Any] = {"protocol": PROTOCOL, "node": node, "encoding": encoding}  # noqa: UP006
    if notices:
        request["notices"] = True
    if key:
        request["key"] = key
    return Frame(FrameKind.HELLO, payload=json.dumps(request).encode())


def data_frame(number: int, request: Dict[str, Any], data: bytes) -> Frame:  # noqa: UP006
    """Return a server service's answer with bytes."""
    return Frame(FrameKind.DATA, number, payload=data_payload(json.dumps(request), data))


def data_payload(text: str, data: bytes) -> bytes:
    """Return the payload of DATA: `u32` length of the JSON, little endian, the JSON object `text`, bytes."""
    encoded = text.encode()
    return b"".join((_JSON_LENGTH.pack(len(encoded)), encoded, data))


def advance(number: int, until: int, *, each_tick: bool) -> Frame:
    """Return a request to advance time to the first tick at or after `until` [ns].

    It ends early in the tick of a message that is not quiet, and with `each_tick` after the next tick.
    """
    return Frame(FrameKind.ADVANCE, number, payload=_ADVANCE.pack(until, each_tick))


def read_advance(frame: Frame) -> Tuple[int, bool]:  # noqa: UP006
    """Return the end of an ADVANCE [ns], and True if it is for one tick; a FrameError if the payload is wrong."""
    try:
        until, each_tick = _ADVANCE.unpack(frame.payload)
    except struct.error as error:
        raise FrameError(f"invalid payload of ADVANCE: {error}") from None
    return until, bool(each_tick)


def time_frame(number: int, now: int) -> Frame:
    """Return the answer to ADVANCE: simulation time [ns]."""
    return Frame(FrameKind.TIME, number, payload=_TIME.pack(now))


def read_time(frame: Frame) -> int:
    """Return simulation time [ns]; a FrameError if the payload is wrong."""
    try:
        (now,) = _TIME.unpack(frame.payload)
    except struct.error as error:
        raise FrameError(f"invalid payload of TIME: {error}") from None
    return int(now)
