"""ROS 1 message bytes: header detection, cellwright_msgs/Step, and the delivery counts that it carries."""

from __future__ import annotations

import re
import struct

_HEADER = re.compile(r"^\s*(?:std_msgs/)?Header\s+header\s*(?:#.*)?$")
_NO_FIELD = re.compile(r"^\s*(?:#.*)?$|^\s*\w+\s+\w+\s*=")  # comments and constants
STEP_TYPE = "cellwright_msgs/Step"
STEP_MD5 = "7e9a558e71e0b64a2a795a7415a8d616"
_NANOSECONDS = 1_000_000_000
_DURATION = struct.Struct("<ii")
_TIME = struct.Struct("<II")
_COUNT = struct.Struct("<I")


def has_header(definition: str) -> bool:
    """True if messages of this definition begin with a header, whose first four bytes count them."""
    for line in definition.splitlines():
        if not _NO_FIELD.match(line):
            return _HEADER.match(line) is not None
    return False


def read_step_request(data: bytes) -> tuple[int, dict[str, int]]:
    """Read a request: its duration [ns], and numbers of messages published by topic.

    Raises:
        struct.error: the bytes are no request.
        ValueError: the same.
    """
    seconds, nanoseconds = _DURATION.unpack_from(data)
    names, numbers, end = _read_counts(data, _DURATION.size)
    if numbers and len(numbers) != len(names):
        raise ValueError(f"topics and published must have the same length (got {len(names)} and {len(numbers)})")
    if len(data) != end:
        raise ValueError("wrong length")
    return seconds * _NANOSECONDS + nanoseconds, dict(zip(names, numbers))


def step_request(duration: int, published: dict[str, int]) -> bytes:
    """Return the bytes of a request; `duration` in nanoseconds, not negative."""
    return _DURATION.pack(*divmod(duration, _NANOSECONDS)) + _counts(list(published.items()))


def read_step_response(data: bytes) -> tuple[str, int, list[tuple[str, int]]]:
    """Read a response: its error (empty for success), simulation time [ns], and numbers of messages sent by topic."""
    succeeded = bool(data[0]) if data else False
    message, position = _read_text(data, 1)
    seconds, nanoseconds = _TIME.unpack_from(data, position)
    names, sent, _ = _read_counts(data, position + _TIME.size)
    failure = "" if succeeded else message or "step failed"
    return failure, seconds * _NANOSECONDS + nanoseconds, list(zip(names, sent))


def step_response(failure: str, now: int, sent: list[tuple[str, int]]) -> bytes:
    """Return the bytes of a response: a success if `failure` is empty; `now` in nanoseconds."""
    return bytes([not failure]) + _text(failure) + _TIME.pack(*divmod(now, _NANOSECONDS)) + _counts(sent)


def _counts(counts: list[tuple[str, int]]) -> bytes:
    """Return the bytes of a list of topics, and of a list of their numbers of messages."""
    size = _COUNT.pack(len(counts))
    names = b"".join(_text(name) for name, _ in counts)
    return size + names + size + struct.pack(f"<{len(counts)}Q", *(count for _, count in counts))


def _read_counts(data: bytes, position: int) -> tuple[list[str], tuple[int, ...], int]:
    """Read topics and numbers of messages at a position; return them with their end."""
    (size,) = _COUNT.unpack_from(data, position)
    position += _COUNT.size
    names = []
    for _ in range(size):
        name, position = _read_text(data, position)
        names.append(name)
    (size,) = _COUNT.unpack_from(data, position)
    numbers = struct.Struct(f"<{size}Q")
    position += _COUNT.size
    return names, numbers.unpack_from(data, position), position + numbers.size


def _text(text: str) -> bytes:
    data = text.encode()
    return _COUNT.pack(len(data)) + data


def _read_text(data: bytes, position: int) -> tuple[str, int]:
    """Read the text at a position; return it with its end."""
    (length,) = _COUNT.unpack_from(data, position)
    begin = position + _COUNT.size
    end = begin + length
    if end > len(data):
        raise ValueError("text is cut off")
    return data[begin:end].decode(), end


class DeliveryCounter:
    """Counter of messages sent, by caller and topic, since the caller connected."""

    def __init__(self) -> None:
        self._counts: dict[str, dict[str, int]] = {}

    def begin(self, caller: str, topic: str) -> None:
        """Note that a caller connected to a topic; this resets the count of an earlier connection."""
        self._counts.setdefault(caller, {})[topic] = 0

    def end(self, caller: str, topic: str) -> None:
        """Note that a caller left a topic."""
        counts = self._counts.get(caller, {})
        counts.pop(topic, None)
        if not counts:
            self._counts.pop(caller, None)

    def count(self, caller: str, topic: str) -> None:
        """Count one message to a caller."""
        counts = self._counts[caller]
        counts[topic] = counts.pop(topic) + 1

    def of(self, caller: str) -> list[tuple[str, int]]:
        """Return topics with numbers of messages sent to the caller; the topic of the newest message comes last."""
        return list(self._counts.get(caller, {}).items())
