"""Joint states: names and numbers, read without building a message for each of some ten thousand."""

from __future__ import annotations

import struct

import numpy as np

from cellwright.middleware.messages import from_cdr
from cellwright.middleware.messages.standard import JointState
from cellwright.recording.format.reader import RecordedMessage
from cellwright.recording.plots.reading.reader import SECOND
from cellwright.recording.plots.tracks import Array
from cellwright.util.errors import MessageError

_HEAD, _STAMP = 4, 8  # bytes: what CDR begins with, and the time of the message
_LITTLE = b"\x00\x01"


class JointStates:
    """Reads the positions of one topic.

    Args:
        topic: its name.
    """

    def __init__(self, topic: str) -> None:
        self.topics = (topic,)
        self._names: list[tuple[str, ...]] = []
        self._before = b""  # what stands between stamp and positions in the message before
        self._count = 0
        self._times: list[list[float]] = []
        self._rows: list[list[Array]] = []

    def take(self, message: RecordedMessage) -> None:
        """Take the next message; one with other names begins a new table."""
        data = message.data
        begin = _HEAD + _STAMP
        end = begin + len(self._before)
        if not self._before or data[begin:end] != self._before or data[:2] != _LITTLE:  # the first, or another kind
            self._learn(data)
            end = begin + len(self._before)
        if len(data) < end + 8 * self._count:
            raise MessageError("joint states that end in the middle")
        self._times[-1].append(message.time / SECOND)
        self._rows[-1].append(np.frombuffer(data, "<f8", self._count, end))

    def curves(self) -> dict[str, tuple[Array, Array]]:
        """Times [s] and positions [rad; m] of each joint, in the order in which the joints were named first."""
        found: dict[str, list[tuple[Array, Array]]] = {}
        for names, times, rows in zip(self._names, self._times, self._rows, strict=True):
            at, table = np.array(times), np.array(rows)
            for column, name in enumerate(names if len(times) else ()):
                found.setdefault(name, []).append((at, table[:, column]))
        return {
            name: (np.concatenate([at for at, _ in parts]), np.concatenate([values for _, values in parts]))
            for name, parts in found.items()
        }

    def _learn(self, data: bytes) -> None:
        """Find out where the positions stand, from a message that is read as a whole."""
        message = from_cdr(data, JointState)
        if data[:2] != _LITTLE:
            raise MessageError("joint states in an order of bytes that is not ours")
        if len(message.position) != len(message.name):
            raise MessageError("joint states with other numbers of names and positions")
        place = _HEAD + _STAMP
        try:
            place = _past_text(data, place)
            (count,) = struct.unpack_from("<I", data, place := _aligned(place, 4))
            place += 4
            for _ in range(count):
                place = _past_text(data, _aligned(place, 4))
            place = _aligned(place, 4) + 4  # how many positions
        except struct.error:
            raise MessageError("joint states that end in the middle") from None
        place = _aligned(place, 8) if count else place
        self._before, self._count = data[_HEAD + _STAMP : place], count
        names = tuple(message.name)
        if not self._names or self._names[-1] != names:
            self._names.append(names)
            self._times.append([])
            self._rows.append([])


def _aligned(place: int, size: int) -> int:
    return place + (_HEAD - place) % size


def _past_text(data: bytes, place: int) -> int:
    (length,) = struct.unpack_from("<I", data, place)
    return place + 4 + int(length)
