"""MCAP writer: a file that grows during a run, its background thread, and the summary at its end.

The caller adds bytes and goes on. A thread makes chunks, compresses them (without the interpreter's lock) and hands
them to the operating system, several times a second. SIGKILL loses what came since then.
"""

import os
import struct
import time
import zlib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from threading import Event, Thread
from typing import Self, TypeAlias

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.summary import Summary
from zstandard import ZstdCompressor

from cellwright._package import VERSION
from cellwright.middleware.messages import TYPES, TypeSet, full_name
from cellwright.recording.format.chunks import (
    MESSAGE_OVERHEAD,
    Messages,
    WriteQueue,
    built_bytes,
    encoded_records,
    make_chunk,
)
from cellwright.recording.format.format import MAGIC, PROFILE, RecordedTopic
from cellwright.util.errors import UsageError
from cellwright.util.files import open_descriptor

INTERVAL = 0.25
"""Longest wall time [s] before queued messages are written."""
CHUNK = 1 << 20
"""Maximum uncompressed size of a chunk [bytes], except for a longer single message."""
MAX_WAITING = 64 << 20
"""Bytes that may wait for a slow disk; a caller that adds more waits for it."""


def _encoded_end(summary: Summary, counts: dict[int, int], offset: int, checksum: int) -> bytes:
    """Encode the end of a file, which begins at `offset`.

    Args:
        summary: contents of the file.
        counts: messages by channel.
        offset: length of the file so far [bytes].
        checksum: CRC-32 of the file so far.
    """
    schemas, channels, chunks = list(summary.schemas.values()), list(summary.channels.values()), summary.chunk_indexes
    statistics = Statistics(
        attachment_count=len(summary.attachment_indexes),
        channel_count=len(channels),
        channel_message_counts=counts,
        chunk_count=len(chunks),
        message_count=sum(counts.values()),
        metadata_count=len(summary.metadata_indexes),
        message_start_time=min((each.message_start_time for each in chunks), default=0),
        message_end_time=max((each.message_end_time for each in chunks), default=0),
        schema_count=len(schemas),
    )
    groups: dict[Opcode, Sequence[McapRecord]] = {
        Opcode.SCHEMA: schemas,
        Opcode.CHANNEL: channels,
        Opcode.STATISTICS: [statistics],
        Opcode.CHUNK_INDEX: chunks,
        Opcode.ATTACHMENT_INDEX: summary.attachment_indexes,
        Opcode.METADATA_INDEX: summary.metadata_indexes,
    }
    head = encoded_records(DataEnd(checksum))
    builder, start, offsets = RecordBuilder(), offset + len(head), []
    for opcode, records in groups.items():
        begin = builder.count
        for record in records:
            record.write(builder)
        if records:
            offsets.append(SummaryOffset(opcode, start + begin, builder.count - begin))
    offsets_start = start + builder.count
    for each in offsets:
        each.write(builder)
    body = built_bytes(builder)
    places = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offsets_start)
    footer = Footer(start, offsets_start, zlib.crc32(places, zlib.crc32(body)))
    return head + body + encoded_records(footer) + MAGIC


_Record: TypeAlias = Attachment | Channel | Metadata | Schema


class McapFile:
    """MCAP file that is being written.

    A disk error does not end the run: it is reported once, and nothing is written from then on.

    Args:
        path: the file; an existing one is overwritten.
        report: called with a line when the file can no longer be written.
        types: set of types of its topics.

    Raises:
        UsageError: the file cannot be opened.
    """

    def __init__(
        self, path: Path, *, report: Callable[[str], None] = lambda _line: None, types: TypeSet = TYPES
    ) -> None:
        self.path = path
        self._types = types
        self._report = report
        self._failure = ""
        self._is_deaf = False
        self._waiting: WriteQueue[_Record | Event] = WriteQueue()
        self._wake_at = CHUNK
        self._summary = Summary()
        self._counts: Counter[int] = Counter()  # messages by channel
        self._schemas: dict[str, int] = {}
        self._channels = 0
        self._compressor = ZstdCompressor(level=1)  # a level that costs next to nothing
        self._offset = self._checksum = 0
        try:
            self._file = open_descriptor(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        except OSError as error:
            raise UsageError(f"{path}: cannot be written: {error.strerror or error}") from None
        self._begin = MAGIC + encoded_records(Header(PROFILE, f"cellwright {VERSION}"))
        self._wake, self._is_closing = Event(), False
        self._thread = Thread(target=self._work, name=f"recording {path.name}", daemon=True)
        self._thread.start()

    @property
    def is_whole(self) -> bool:
        """True if everything has been written so far."""
        return not self._failure

    def channel(self, topic: RecordedTopic) -> int:
        """Make a channel for a topic and return its number.

        Raises:
            UnknownNameError: there is no message type of this name.
        """
        schema = self._schemas.get(topic.type)
        if schema is None:
            schema = self._schemas[topic.type] = len(self._schemas) + 1
            name = full_name(self._types.message(topic.type).__msgtype__)
            text = self._types.ros2.generate_msgdef(name, ros_version=2)[0]
            self._waiting.add_record(Schema(id=schema, data=text.encode(), encoding="ros2msg", name=name))
        self._channels += 1
        self._waiting.add_record(Channel(self._channels, topic.name, "cdr", topic.metadata(), schema))
        return self._channels

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        """Add an attachment."""
        self._waiting.add_record(Attachment(0, 0, name, media_type, data))

    def describe(self, name: str, values: Mapping[str, str]) -> None:
        """Add a metadata record."""
        self._waiting.add_record(Metadata(name, dict(values)))

    def add(self, channel: int, time: int, data: bytes) -> None:
        """Add a message.

        Args:
            channel: number of its channel.
            time: [ns], not before that of the message before it.
            data: CDR.
        """
        if self._is_deaf:
            return
        # inlined: this runs thousands of times a second
        waiting = self._waiting
        waiting.entries += (channel, time, data)
        waiting.added = added = waiting.added + MESSAGE_OVERHEAD + len(data)
        if added >= self._wake_at:
            self._wake_writer()

    def flush(self) -> None:
        """Wait until everything that was added has gone to the operating system."""
        done = Event()
        self._waiting.add_record(done)
        self._wake.set()
        while not done.wait(0.1) and self._thread.is_alive():
            pass

    def close(self) -> None:
        """Write the rest and the index, and close the file. A second call does nothing."""
        if not self._is_closing:
            self._is_closing = self._is_deaf = True
            self._wake.set()
            self._thread.join()
            if self._failure:
                self._report(self._failure)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _wake_writer(self) -> None:
        """Wake the thread, as a chunk is full; wait while too many bytes are queued."""
        waiting = self._waiting
        self._wake_at = waiting.added + CHUNK
        self._wake.set()
        while waiting.added - waiting.written > MAX_WAITING and self._thread.is_alive():
            time.sleep(0.001)

    def _work(self) -> None:
        try:
            self._pass_on(self._begin)
            while not self._is_closing:
                self._wake.wait(INTERVAL)
                self._wake.clear()
                self._drain()
            self._drain()
            self._pass_on(_encoded_end(self._summary, self._counts, self._offset, self._checksum))
        except OSError as error:
            self._failure = f"{self.path}: cannot be written any more: {error.strerror or error}"
            self._is_deaf = True
            self._waiting.clear()
        finally:
            try:
                os.close(self._file)
            except OSError as error:
                # some file systems report only now that the disk is full
                self._failure = self._failure or f"{self.path}: may be incomplete: {error.strerror or error}"

    def _drain(self) -> None:
        """Write what was queued when the call began."""
        for item in self._waiting.take():
            if isinstance(item, Messages):
                for part in item.parts(CHUNK):
                    self._write_chunk(part)
            elif isinstance(item, Event):
                item.set()
            else:
                self._write_record(item)

    def _write_chunk(self, messages: Messages) -> None:
        chunk = make_chunk(self._compressor, messages, self._offset)
        self._pass_on(chunk.data)
        self._summary.chunk_indexes.append(chunk.index)
        self._counts.update(chunk.counts)
        self._waiting.written = int(messages.ends[-1])

    def _write_record(self, record: _Record) -> None:
        data, offset, summary = encoded_records(record), self._offset, self._summary
        self._pass_on(data)
        match record:
            case Schema():
                summary.schemas[record.id] = record
            case Channel():
                summary.channels[record.id] = record
            case Metadata():
                summary.metadata_indexes.append(MetadataIndex(offset, len(data), record.name))
            case Attachment():
                size = len(record.data)
                index = AttachmentIndex(offset, len(data), 0, 0, size, record.name, record.media_type)
                summary.attachment_indexes.append(index)

    def _pass_on(self, data: bytes) -> None:
        rest = memoryview(data)
        while rest:
            rest = rest[os.write(self._file, rest) :]
        self._offset += len(data)
        self._checksum = zlib.crc32(data, self._checksum)
