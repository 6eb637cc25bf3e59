"""What was handed in for a file and is not in it yet: one thread hands in, another takes what there is.

Thousands of messages come a second; nothing is done for each that can be done for many. So there is no object for
a message, which the garbage collector would look at: there are three lists side by side, which are taken in one go. To
append to a list, to copy its head and to delete it are each done at once, whatever another thread is about.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

R = TypeVar("R")
T = TypeVar("T")

HEAD = 31
"""Bytes that a message takes in a file besides its own."""


@dataclass(frozen=True, slots=True)
class Messages:
    """Messages in their order; entry by entry they belong together.

    Attributes:
        channels: numbers of their channels.
        times: when they were said [ns].
        contents: their bytes.
        ends: (n,) how many bytes all that was ever handed in takes up to the end of each.
        begin: how many it takes up to the first.
    """

    channels: list[int]
    times: list[int]
    contents: list[bytes]
    ends: NDArray[np.int64]
    begin: int

    def __len__(self) -> int:
        return len(self.contents)

    def part(self, begin: int, end: int) -> Messages:
        """Some of them."""
        some, before = slice(begin, end), int(self.ends[begin - 1]) if begin else self.begin
        return Messages(self.channels[some], self.times[some], self.contents[some], self.ends[some], before)

    def parts(self, size: int) -> Iterator[Messages]:
        """All of them in parts that end as soon as they have this size [bytes]."""
        begin, before = 0, self.begin
        while begin < len(self):
            end = int(np.searchsorted(self.ends, before + size)) + 1
            part = self.part(begin, end)
            yield part
            begin, before = end, int(part.ends[-1])


class Waiting(Generic[R]):
    """Messages that wait, and records between them.

    Attributes:
        channels, times, contents: of messages; whoever hands one in appends to all three, the content last.
        given: bytes of all messages that were ever handed in; counted by who hands in alone.
        taken: bytes of those that were written; counted by who takes alone.
    """

    def __init__(self) -> None:
        self.channels: list[int] = []
        self.times: list[int] = []
        self.contents: list[bytes] = []
        self.given = self.taken = 0
        self._records: deque[tuple[int, R]] = deque()

    def add_record(self, record: R) -> None:
        """Hand in a record, which stands behind all messages that were handed in so far."""
        self._records.append((self.given, record))

    def take(self) -> Iterator[Messages | R]:
        """What there is, in its order; what is handed in meanwhile is left for the next time."""
        count = len(self.contents)
        channels, times, contents = _head(self.channels, count), _head(self.times, count), _head(self.contents, count)
        sizes = np.fromiter(map(len, contents), np.int64, count) + HEAD
        messages = Messages(channels, times, contents, self.taken + np.cumsum(sizes), self.taken)
        begin, end = 0, int(messages.ends[-1]) if count else self.taken
        while self._records and self._records[0][0] <= end:
            place, record = self._records.popleft()
            behind = int(np.searchsorted(messages.ends, place, "right"))
            if behind > begin:
                yield messages.part(begin, behind)
            begin = behind
            yield record
        if begin < count:
            yield messages.part(begin, count)

    def clear(self) -> None:
        """Forget everything; nothing more is taken."""
        self.channels.clear()
        self.times.clear()
        self.contents.clear()
        self._records.clear()


def _head(values: list[T], count: int) -> list[T]:
    """Take the first of a list out of it."""
    head = values[:count]
    del values[:count]
    return head
