"""What playing needs of a recording: a `Recording` has it, and so may something else, such as a list in a test."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Protocol

from cellwright.recording.format.format import RecordedTopic
from cellwright.recording.format.header import RecordingHeader
from cellwright.recording.format.reader import RecordedMessage


class Source(Protocol):
    """Something recorded. Messages are in the order of their times."""

    @property
    def header(self) -> RecordingHeader:
        """What it is of."""
        ...

    @property
    def topics(self) -> Mapping[str, RecordedTopic]:
        """The topics by name, those that Cellwright adds among them."""
        ...

    @property
    def begin(self) -> int:
        """Time of the first message [ns]."""
        ...

    @property
    def end_time(self) -> int:
        """Time of the last message [ns]."""
        ...

    @property
    def scene(self) -> bytes | None:
        """What there is to be seen, encoded; None where that is missing."""
        ...

    def messages(
        self, topics: Collection[str] | None = None, *, start: int | None = None, until: int | None = None
    ) -> Iterator[RecordedMessage]:
        """The messages of some topics, or of all, from `start` [ns] on and before `until` [ns]."""
        ...

    def newest(self, topic: str, time: int) -> RecordedMessage | None:
        """The newest message of a topic at or before a time [ns]; None when there is none yet."""
        ...
