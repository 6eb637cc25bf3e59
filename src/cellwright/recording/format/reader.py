"""Recording reader: topics, messages, commands and frames, also of truncated files."""

import json
from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack, contextmanager
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple, Self

from cellwright.middleware.messages import TYPES, TypeSet
from cellwright.middleware.messages.standard import String, UInt8MultiArray
from cellwright.recording.format import format as names
from cellwright.recording.format.commands import Command
from cellwright.recording.format.format import FRAME, OWN_TOPICS, Entry, RecordingHeader
from cellwright.recording.format.scan import ChunkPlace, chunk_entries, scan_file, unpack_chunk, verify_checksums
from cellwright.rendering.scene.scene import SceneFrame, decode_frame, is_whole_frame
from cellwright.util.errors import (
    CellwrightError,
    ForeignRecordingError,
    MessageError,
    RecordingError,
    UnknownNameError,
    UsageError,
)
from cellwright.util.files import open_to_read

_KEPT = 8  # unpacked chunks that are kept, for repeated reads in one place
_PROGRESS_PERIOD = 500  # messages
_WHOLE_FRAME_SEARCH = 5_000_000_000  # [ns] searched backwards for a whole frame; there is one a second


class RecordedMessage(NamedTuple):
    """A message in a recording: topic, time [ns] and bytes (CDR)."""

    topic: str
    time: int
    data: bytes


class RecordingFile:
    """Recording that is open for reading; its messages are of the set `types`.

    Raises:
        ForeignRecordingError: it is an MCAP file of another program.
        RecordingError: it cannot be read.
    """

    def __init__(self, path: str | Path, *, types: TypeSet = TYPES) -> None:
        self.path = Path(path)
        self.types = types
        self._counted, self._records = set[int](), 0  # the chunks that were read, by offset, and their records
        self._unpacked: dict[int, bytes] = {}  # chunks by offset, the one used last at the end
        with ExitStack() as opened:
            with self._named_errors():
                self._file = opened.enter_context(open_to_read(self.path))
                self._layout = scan_file(self._file)
                if names.METADATA not in self._layout.metadata:
                    raise ForeignRecordingError("an MCAP file, but not a recording of Cellwright")
                self.header = RecordingHeader.of(self._layout.metadata[names.METADATA])
            self._names = {number: topic.name for number, topic in self._layout.topics.items()}
            self.topics = {topic.name: topic for topic in self._layout.topics.values()}
            """Its topics by name, including those that Cellwright adds."""
            if any(each.is_cut and not any(self._entries(each)) for each in self._layout.chunks[-1:]):
                self._layout.chunks.pop()
            opened.pop_all()

    @property
    def is_complete(self) -> bool:
        """True if it was ended properly; a truncated one is read as far as it goes."""
        return self._layout.is_complete

    @property
    def attachments(self) -> list[str]:
        """Names of the attachments."""
        return sorted(self._layout.attachments)

    def attachment(self, name: str) -> bytes:
        """Return the content of an attachment.

        Raises:
            UnknownNameError: there is none of this name.
        """
        if name not in self._layout.attachments:
            raise UnknownNameError("attachment", name, self.attachments)
        offset, length, _ = self._layout.attachments[name]
        with self._named_errors():
            return self._read(offset, length)

    @cached_property
    def sources(self) -> dict[str, bytes]:
        """The files that the cell or robot was read from, by their names in the recording."""
        prefix = names.SOURCES
        found = [name for name in self.attachments if name.startswith(prefix)]
        return {name.removeprefix(prefix): self.attachment(name) for name in found}

    @property
    def scene(self) -> bytes | None:
        """The encoded scene, for `scene.decode_scene`."""
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
        """Verify all checksums of the file, also of parts that are not read otherwise.

        Raises:
            RecordingError: it is damaged; the text says where.
        """
        with self._named_errors():
            verify_checksums(self._file, self._layout)

    def messages(
        self, topics: Collection[str] | None = None, *, start: int | None = None, until: int | None = None
    ) -> Iterator[RecordedMessage]:
        """Yield the messages of some topics, or of all, in order.

        Args:
            topics: names of topics; those that are not in the recording have no messages.
            start: from this time [ns] on.
            until: before this time [ns].

        Raises:
            RecordingError: the file is damaged.
        """
        channels = {number for number, name in self._names.items() if topics is None or name in topics}
        for chunk in self._chunks(channels, start, until):
            for channel, time, data in self._entries(chunk, channels):
                if (start is None or time >= start) and (until is None or time < until):
                    yield RecordedMessage(self._names[channel], time, data)

    def newest(self, topic: str, time: int) -> RecordedMessage | None:
        """Return the newest message of a topic at or before a time [ns]; None if there is none."""
        channels = {number for number, name in self._names.items() if name == topic}
        for chunk in reversed(list(self._chunks(channels, None, time + 1))):
            found = [(when, data) for _, when, data in self._entries(chunk, channels) if when <= time]
            if found:
                return RecordedMessage(topic, *found[-1])
        return None

    def decode(self, message: RecordedMessage) -> Any:
        """Decode a message.

        Raises:
            RecordingError: its type is unknown here, or its bytes do not fit the type.
        """
        try:
            type_name = OWN_TOPICS.get(message.topic) or self.topics[message.topic].type
            return self.types.from_cdr(message.data, self.types.message(type_name))
        except CellwrightError as error:
            raise RecordingError(f"{self.path}: {message.topic} at {message.time / 1e9:.3f} s: {error}") from None

    def commands(self) -> Iterator[Command]:
        """Yield the external input, in order.

        Raises:
            RecordingError: the file is damaged.
        """
        for message in self.messages([names.COMMAND]):
            yield Command.decode(self.decode(message).data)

    def values(
        self, topic: str, *, start: int | None = None, until: int | None = None
    ) -> Iterator[tuple[int, dict[str, Any]]]:
        """Yield the JSON objects of a topic such as `/cellwright/event`, with their times [ns].

        Raises:
            RecordingError: the file is damaged.
        """
        for message in self.messages([topic], start=start, until=until):
            try:
                value = json.loads(self.decode(message).data)
            except (ValueError, RecursionError):
                value = None
            if not isinstance(value, dict):
                raise RecordingError(f"{self.path}: {topic} at {message.time / 1e9:.3f} s is not a JSON object")
            yield message.time, value

    @cached_property
    def end(self) -> dict[str, Any] | None:
        """Result of the run; None if the recording is truncated."""
        found = [value for _, value in self.values(names.END)]
        return found[-1] if found else None

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _chunks(self, channels: set[int], start: int | None, until: int | None) -> Iterator[ChunkPlace]:
        """Yield the chunks that may hold messages of some channels from `start` [ns] on and before `until` [ns]."""
        chunks = self._layout.chunks
        for chunk in chunks[0 if start is None else bisect_left(chunks, start, key=lambda each: each.last) :]:
            if until is not None and chunk.first >= until:
                return
            if not chunk.counts or channels.intersection(chunk.counts):
                yield chunk

    def _entries(self, chunk: ChunkPlace, channels: Collection[int] | None = None) -> Iterator[Entry]:
        """Yield the messages of some channels in a chunk, or of all."""
        with self._named_errors():
            data = self._unpacked.pop(chunk.offset, None)
            if data is None:
                data = unpack_chunk(self._read(chunk.offset, chunk.length), chunk)
            self._unpacked[chunk.offset] = data
            if len(self._unpacked) > _KEPT:
                del self._unpacked[next(iter(self._unpacked))]
            is_known = chunk.offset in self._counted
            left = self._layout.max_records - (0 if is_known else self._records)
            number = yield from chunk_entries(data, self._names if channels is None else channels, left)
            if not is_known:
                self._counted.add(chunk.offset)
                self._records += number

    def _read(self, offset: int, length: int) -> bytes:
        try:
            self._file.seek(offset)
            data = self._file.read(length)
        except ValueError as error:  # the file is closed
            raise RecordingError(f"cannot be read: {error}") from None
        if len(data) < length:
            raise RecordingError("the file shrank while it was read")
        return data

    @contextmanager
    def _named_errors(self) -> Iterator[None]:
        """Turn read errors into a RecordingError that begins with the path."""
        try:
            yield
        except RecordingError as error:
            raise type(error)(f"{self.path}: {error}") from None
        except OSError as error:
            raise RecordingError(f"{self.path}: cannot be read: {error.strerror or error}") from None


class TimeRange:
    """Part of a recording from one time [ns] up to another; None: from the begin, to the end.

    Attributes:
        begin, end: its first and last time [ns].

    Raises:
        UsageError: it contains no messages.
    """

    def __init__(self, source: RecordingFile, start: int | None, until: int | None) -> None:
        self._source = source
        self.begin = source.begin if start is None else max(source.begin, start)
        self.end = source.end_time if until is None else min(source.end_time, until)
        if self.begin > self.end:
            raise UsageError(f"{source.path}: no messages in this time range")

    def messages(
        self, topics: Collection[str], on_progress: Callable[[float], None] | None = None
    ) -> Iterator[RecordedMessage]:
        """Yield the messages that are latched at its begin, with that time, then the messages in it.

        `on_progress` is called now and then with the finished share, 0..1.
        """
        found = self._source.messages(topics, start=self.begin, until=self.end + 1)
        for number, message in enumerate(chain(self._latched(topics), found)):
            if on_progress is not None and number % _PROGRESS_PERIOD == 0:
                on_progress((message.time - self.begin) / max(1, self.end - self.begin))
            yield message

    def _latched(self, topics: Collection[str]) -> Iterator[RecordedMessage]:
        source = self._source
        for topic in topics if self.begin > source.begin else ():
            latched = source.newest(topic, self.begin) if source.topics[topic].latch else None
            if latched is not None and latched.time < self.begin:
                yield latched._replace(time=self.begin)


def recorded_frames(
    recording: RecordingFile, *, start: int | None = None, until: int | None = None
) -> Iterator[SceneFrame]:
    """Yield the frames from `start` on and before `until` [ns], in order. Changes without a whole frame are skipped.

    Raises:
        RecordingError: the file is damaged.
    """
    before: SceneFrame | None = None
    begin = None if start is None else start - _WHOLE_FRAME_SEARCH
    for message in recording.messages([FRAME], start=begin, until=until):
        data = frame_bytes(message.data)
        if before is None and not is_whole_frame(data):
            # a change whose whole frame is not here
            continue
        try:
            before = decode_frame(data, before)
        except MessageError as error:
            raise RecordingError(f"{recording.path}: {FRAME} at {message.time / 1e9:.3f} s: {error}") from None
        if start is None or message.time >= start:
            yield before


def json_object(data: bytes) -> dict[str, Any]:
    """Decode the JSON object in a string message (CDR).

    Raises:
        MessageError: there is none.
    """
    try:
        found = json.loads(TYPES.from_cdr(data, String).data)
    except (ValueError, RecursionError):
        raise MessageError("not valid JSON") from None
    if not isinstance(found, dict):
        raise MessageError("not a JSON object")
    return found


def frame_bytes(data: bytes) -> bytes:
    """Return the bytes of a frame from the message that carries it (CDR); empty if it is no such message."""
    try:
        return TYPES.from_cdr(data, UInt8MultiArray).data.tobytes()
    except MessageError:
        return b""
