"""ROS 1 message bytes: header detection, cellwright_msgs/Step, and the delivery counts that it carries."""

from __future__ import annotations

import re
import struct

_HEADER = re.compile(r"^\s*(?:std_msgs/)?Header\s+header\s*(?:#.*)?$")
_NO_FIELD = re.compile(r"^\s*(?:#.*)?$|^\s*\w+\s+\w+\s*=")
"""Comments and constants."""


def has_header(definition: str) -> bool:
    """Whether messages of this definition begin with a header, whose first four bytes count them."""
    for line in definition.splitlines():
        if not _NO_FIELD.match(line):
            return _HEADER.match(line) is not None
    return False


STEP_TYPE = "cellwright_msgs/Step"
STEP_MD5 = "7e9a558e71e0b64a2a795a7415a8d616"

_NANOSECONDS = 1_000_000_000
_DURATION = struct.Struct("<ii")
_TIME = struct.Struct("<II")
_COUNT = struct.Struct("<I")
_NUMBER = struct.Struct("<Q")


def read_step_request(data: bytes) -> tuple[int, dict[str, int]]:
    """The duration [ns] of a request, and the numbers of messages published by topic.

    Raises:
        struct.error, ValueError: these bytes are no request.
    """
    seconds, nanoseconds = _DURATION.unpack_from(data)
    position = _DURATION.size
    (count,) = _COUNT.unpack_from(data, position)
    position += _COUNT.size
    names = []
    for _ in range(count):
        name, position = _read_text(data, position)
        names.append(name)
    (numbers,) = _COUNT.unpack_from(data, position)
    position += _COUNT.size
    if numbers and numbers != count:
        raise ValueError(f"{count} topics and {numbers} numbers of messages")
    if len(data) != position + numbers * _NUMBER.size:
        raise ValueError("its length is wrong")
    published = [_NUMBER.unpack_from(data, position + index * _NUMBER.size)[0] for index in range(numbers)]
    return seconds * _NANOSECONDS + nanoseconds, dict(zip(names, published))


def step_request(duration: int, published: dict[str, int]) -> bytes:
    """The bytes of a request; `duration` in nanoseconds, not negative."""
    parts = [_DURATION.pack(*divmod(duration, _NANOSECONDS)), _COUNT.pack(len(published))]
    parts += [_text(name) for name in published]
    parts.append(_COUNT.pack(len(published)))
    parts += [_NUMBER.pack(count) for count in published.values()]
    return b"".join(parts)


def read_step_response(data: bytes) -> tuple[str, int, list[tuple[str, int]]]:
    """Why it failed (empty if it did not), simulation time [ns], and topics with numbers of messages sent.

    Raises:
        struct.error, ValueError: these bytes are no answer.
    """
    succeeded = bool(data[0]) if data else False
    message, position = _read_text(data, 1)
    seconds, nanoseconds = _TIME.unpack_from(data, position)
    position += _TIME.size
    (count,) = _COUNT.unpack_from(data, position)
    position += _COUNT.size
    names = []
    for _ in range(count):
        name, position = _read_text(data, position)
        names.append(name)
    position += _COUNT.size
    sent = [_NUMBER.unpack_from(data, position + index * _NUMBER.size)[0] for index in range(count)]
    failure = "" if succeeded else message or "it has failed"
    return failure, seconds * _NANOSECONDS + nanoseconds, list(zip(names, sent))


def step_response(failure: str, now: int, sent: list[tuple[str, int]]) -> bytes:
    """The bytes of an answer: a success unless a failure is told; `now` in nanoseconds."""
    parts = [bytes([not failure]), _text(failure), _TIME.pack(*divmod(now, _NANOSECONDS)), _COUNT.pack(len(sent))]
    parts += [_text(name) for name, _ in sent]
    parts.append(_COUNT.pack(len(sent)))
    parts += [_NUMBER.pack(count) for _, count in sent]
    return b"".join(parts)


def _text(text: str) -> bytes:
    data = text.encode()
    return _COUNT.pack(len(data)) + data


def _read_text(data: bytes, position: int) -> tuple[str, int]:
    """The text at a position, and where it ends."""
    (length,) = _COUNT.unpack_from(data, position)
    begin = position + _COUNT.size
    end = begin + length
    if end > len(data):
        raise ValueError("it is cut off")
    return data[begin:end].decode(), end


class DeliveryCounter:
    """Counts by caller and topic, since the caller connected."""

    def __init__(self) -> None:
        self._counts: dict[str, dict[str, int]] = {}

    def begin(self, caller: str, topic: str) -> None:
        """A caller has connected to a topic; if it did before, that connection does not count any more."""
        self._counts.setdefault(caller, {})[topic] = 0

    def end(self, caller: str, topic: str) -> None:
        """A caller has left a topic."""
        counts = self._counts.get(caller, {})
        counts.pop(topic, None)
        if not counts:
            self._counts.pop(caller, None)

    def count(self, caller: str, topic: str) -> None:
        """A caller is being sent one message more."""
        counts = self._counts[caller]
        counts[topic] = counts.pop(topic) + 1

    def of(self, caller: str) -> list[tuple[str, int]]:
        """Topics and how many messages the caller was sent, the topic of the newest message last."""
        return list(self._counts.get(caller, {}).items())
