"""Recording reader: topics, messages, commands and frames, also of files that were cut short."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, Self

from cellwright.middleware.messages import Message, from_cdr, message_type, short_name
from cellwright.middleware.messages.standard import String, UInt8MultiArray
from cellwright.recording.format import format as names
from cellwright.recording.format.commands import Command
from cellwright.recording.format.format import FRAME, Entry, RecordedTopic, RecordingHeader
from cellwright.recording.format.scan import ChannelRecord, ChunkPlace
from cellwright.recording.format.scanned_file import ScannedFile, named_errors
from cellwright.rendering.scene.scene import Frame, decode_frame, is_whole_frame
from cellwright.util.errors import CellwrightError, MessageError, RecordingError, UnknownNameError, UsageError


class RecordedMessage(NamedTuple):
    """A message in a recording: its topic, its time [ns] and its bytes, CDR."""

    topic: str
    time: int
    data: bytes


class Recording:
    """A recording, opened for reading.

    Args:
        path: the file.

    Raises:
        RecordingError: it cannot be read, or is no recording of Cellwright.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._file = ScannedFile(self.path)
        self._layout = self._file.layout
        try:
            with named_errors(self.path):
                self.header = RecordingHeader.of(self._layout.metadata.get(names.METADATA, {}))
            channels = {number: each for number, each in self._layout.channels.items() if each.encoding == "cdr"}
            self.topics: dict[str, RecordedTopic] = {each.topic: _topic(each) for each in channels.values()}
            """The topics in it by name, those that Cellwright adds among them."""
            self._names = {number: each.topic for number, each in channels.items()}
            if any(each.is_cut and not any(self._entries(each)) for each in self._layout.chunks[-1:]):
                self._layout.chunks.pop()
        except BaseException:
            self._file.close()
            raise

    @property
    def is_complete(self) -> bool:
        """Whether it was ended as it should be; one that was cut short is read as far as it goes."""
        return self._layout.is_complete

    @property
    def attachments(self) -> list[str]:
        """Names of the files within the file."""
        return sorted(self._layout.attachments)

    def attachment(self, name: str) -> bytes:
        """A file within the file.

        Raises:
            UnknownNameError: there is none of this name.
        """
        if name not in self._layout.attachments:
            raise UnknownNameError("attachment", name, self.attachments)
        offset, length = self._layout.attachments[name]
        return self._file.read(offset, length)

    @cached_property
    def sources(self) -> dict[str, bytes]:
        """The files that the cell or robot was read from, by their names in the recording."""
        prefix = names.SOURCES
        found = [name for name in self.attachments if name.startswith(prefix)]
        return {name.removeprefix(prefix): self.attachment(name) for name in found}

    @property
    def scene(self) -> bytes | None:
        """The scene, as `scene.decode_scene` takes it."""
        return self.attachment(names.SCENE) if names.SCENE in self._layout.attachments else None

    @property
    def start(self) -> bytes | None:
        """The checkpoint that the run began from, if it did not begin at time 0."""
        return self.attachment(names.START) if names.START in self._layout.attachments else None

    @property
    def begin(self) -> int:
        """Time of the first message [ns]; 0 without any."""
        return self._layout.chunks[0].first if self._layout.chunks else 0

    @cached_property
    def end_time(self) -> int:
        """Time of the last message [ns]; 0 without any."""
        chunks = self._layout.chunks
        if not chunks:
            return 0
        if not chunks[-1].is_cut:
            return max(each.last for each in chunks)
        return max((time for _, time, _ in self._entries(chunks[-1])), default=chunks[-1].first)

    @cached_property
    def counts(self) -> Counter[str]:
        """Messages by topic."""
        found: Counter[str] = Counter()
        for chunk in self._layout.chunks:
            counts = chunk.counts or Counter(channel for channel, _, _ in self._entries(chunk))
            for channel, count in counts.items():
                if channel in self._names:
                    found[self._names[channel]] += count
        return found

    def check_bytes(self) -> None:
        """Compare the checksums of the whole file with its bytes, also of what nobody asks for here.

        Raises:
            RecordingError: it is damaged; the text says where.
        """
        self._file.check_bytes()

    def messages(
        self, topics: Collection[str] | None = None, *, start: int | None = None, until: int | None = None
    ) -> Iterator[RecordedMessage]:
        """The messages of some topics, or of all, in order.

        Args:
            topics: names of topics; those that are not in the recording have no messages.
            start: from this time [ns] on.
            until: before this time [ns].

        Raises:
            RecordingError: the file is damaged.
        """
        wanted = {number for number, name in self._names.items() if topics is None or name in topics}
        for chunk in self._file.chunks(start, until):
            if chunk.counts and not wanted.intersection(chunk.counts):
                continue
            for channel, time, data in self._entries(chunk, wanted):
                if (start is None or time >= start) and (until is None or time < until):
                    yield RecordedMessage(self._names[channel], time, data)

    def newest(self, topic: str, time: int, *, at_least: int | None = None) -> RecordedMessage | None:
        """The newest message of a topic at or before a time [ns]; None where there is none after `at_least` [ns]."""
        wanted = {number for number, name in self._names.items() if name == topic}
        for chunk in reversed(list(self._file.chunks(at_least, time + 1))):
            if chunk.counts and not wanted.intersection(chunk.counts):
                continue
            found = [(when, data) for _, when, data in self._entries(chunk, wanted) if when <= time]
            if found:
                return RecordedMessage(topic, *found[-1])
        return None

    def decode(self, message: RecordedMessage) -> Message:
        """A message as the bus had it.

        Raises:
            RecordingError: its type is not known here, or its bytes are none of it.
        """
        try:
            return from_cdr(message.data, message_type(self.topics[message.topic].type))
        except CellwrightError as error:
            raise RecordingError(f"{self.path}: {message.topic} at {message.time / 1e9:.3f} s: {error}") from None

    def content(self, message: RecordedMessage) -> bytes:
        """What a message of a topic that Cellwright adds holds: JSON, or a frame's bytes.

        Raises:
            RecordingError: its bytes are no such message.
        """
        try:
            if names.OWN_TOPICS[message.topic] == names.BYTES:
                return from_cdr(message.data, UInt8MultiArray).data.tobytes()
            return from_cdr(message.data, String).data.encode()
        except (MessageError, UnicodeEncodeError) as error:
            raise RecordingError(f"{self.path}: {message.topic} at {message.time / 1e9:.3f} s: {error}") from None

    def commands(self) -> Iterator[Command]:
        """What came from outside, in order.

        Raises:
            RecordingError: the file is damaged.
        """
        for message in self.messages([names.COMMAND]):
            yield Command.decode(self.content(message).decode())

    def values(
        self, topic: str, *, start: int | None = None, until: int | None = None
    ) -> Iterator[tuple[int, dict[str, Any]]]:
        """The JSON objects of a topic that carries such, such as `/cellwright/event`, with their times [ns].

        Raises:
            RecordingError: the file is damaged.
        """
        for message in self.messages([topic], start=start, until=until):
            try:
                value = json.loads(self.content(message))
            except (ValueError, RecursionError):
                value = None
            if not isinstance(value, dict):
                raise RecordingError(f"{self.path}: {topic} at {message.time / 1e9:.3f} s is no JSON object")
            yield message.time, value

    @cached_property
    def end(self) -> dict[str, Any] | None:
        """What came of the run; None if it was cut short."""
        found = [value for _, value in self.values(names.END)]
        return found[-1] if found else None

    def close(self) -> None:
        """Read no more."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _entries(self, chunk: ChunkPlace, channels: Collection[int] | None = None) -> Iterator[Entry]:
        return self._file.entries(chunk, self._names if channels is None else channels)


def _topic(channel: ChannelRecord) -> RecordedTopic:
    told = channel.metadata
    return RecordedTopic(
        channel.topic,
        short_name(channel.type),
        told.get("direction", "out"),
        told.get("rate", ""),
        told.get("latch") == "true",
        told.get("node", ""),
    )


_PROGRESS_PERIOD = 500  # messages


@dataclass(frozen=True)
class TimeRange:
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

    def messages(
        self, source: Recording, topics: Collection[str], on_progress: Callable[[float], None] | None = None
    ) -> Iterator[RecordedMessage]:
        """What was latched when it begins, as if it were said then, and what was said in it.

        Args:
            source: the recording.
            topics: names of topics.
            on_progress: takes now and then how much of it is over, 0..1.
        """
        for number, message in enumerate(self._messages(source, topics)):
            if on_progress is not None and number % _PROGRESS_PERIOD == 0:
                on_progress(self.share(message.time))
            yield message

    def _messages(self, source: Recording, topics: Collection[str]) -> Iterator[RecordedMessage]:
        for topic in topics if self.begins_later else ():
            latched = source.newest(topic, self.begin) if source.topics[topic].latch else None
            if latched is not None and latched.time < self.begin:
                yield latched._replace(time=self.begin)
        yield from source.messages(topics, start=self.begin, until=self.end + 1)


WHOLE_FRAME_SEARCH = 5_000_000_000
"""So far back [ns] a whole frame is looked for; there is one a second."""


def recorded_frames(recording: Recording, *, start: int | None = None, until: int | None = None) -> Iterator[Frame]:
    """The frames from a time on and before another [ns], in order. Changes to a frame that was cut off are left out.

    Raises:
        RecordingError: the file is damaged.
    """
    before: Frame | None = None
    begin = None if start is None else start - WHOLE_FRAME_SEARCH
    for message in recording.messages([FRAME], start=begin, until=until):
        data = frame_bytes(message.data)
        if before is None and not is_whole_frame(data):
            continue  # it begins in the middle of a second
        try:
            before = decode_frame(data, before)
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
