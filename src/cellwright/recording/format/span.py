"""A part of a recording, for a file that is made of it."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Self

from cellwright.recording.format.reader import RecordedMessage, Recording
from cellwright.util.errors import UsageError


@dataclass(frozen=True)
class Span:
    """The part of a recording that is wanted: its first and last time [ns], and whether something is before it."""

    begin: int
    end: int
    begins_later: bool

    @classmethod
    def of(cls, source: Recording, start: int | None, until: int | None) -> Self:
        """The part from one time [ns] up to another; None: from the begin, to the end.

        Raises:
            UsageError: nothing is in it at these times.
        """
        begin = source.begin if start is None else max(source.begin, start)
        end = source.end_time if until is None else min(source.end_time, until)
        if begin > end:
            raise UsageError(f"{source.path}: nothing is in it at these times")
        return cls(begin, end, begin > source.begin)

    def share(self, time: int) -> float:
        """How much of it is over, 0..1."""
        return (time - self.begin) / max(1, self.end - self.begin)

    def messages(self, source: Recording, topics: Collection[str]) -> Iterator[RecordedMessage]:
        """What was latched when it begins, as if it were said then, and what was said in it."""
        for topic in topics if self.begins_later else ():
            latched = source.newest(topic, self.begin) if source.topics[topic].latch else None
            if latched is not None and latched.time < self.begin:
                yield latched._replace(time=self.begin)
        yield from source.messages(topics, start=self.begin, until=self.end + 1)
