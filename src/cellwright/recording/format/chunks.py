"""MCAP chunks: a write queue of messages, and the compressed, indexed chunks made of them.

Thousands of messages come a second, so work is done for many of them at once. A message is no object, which the garbage
collector would visit: one list holds channel, time and content of each in turn. Adding the three to a list, copying its
head and deleting it are atomic each, whatever another thread does.
"""

from __future__ import annotations

import struct
import zlib
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from typing import Any, Generic, TypeVar

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Chunk, ChunkIndex, McapRecord
from numpy.typing import NDArray

R = TypeVar("R")
MESSAGE_OVERHEAD = 31
"""Bytes that a message takes in a file besides its content."""
_MESSAGE = np.dtype(
    [
        ("opcode", "u1"),
        ("length", "<u8"),
        ("channel", "<u2"),
        ("sequence", "<u4"),
        ("log_time", "<u8"),
        ("publish_time", "<u8"),
    ]
)
"""Head of a message record, before its content."""
_RECORD_HEAD = 9  # bytes of opcode and length, which the length does not count
_AS_BYTES = np.dtype(("V", _MESSAGE.itemsize))
_INDEX = struct.Struct("<BQHI")  # opcode, length, channel, bytes that follow
_ZSTD = "zstd"


def encoded_records(*records: McapRecord) -> bytes:
    """Encode records as they stand in the file."""
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return built_bytes(builder)


def built_bytes(builder: RecordBuilder) -> bytes:
    """Return the bytes that a builder holds."""
    return bytes(builder.end())  # type: ignore[no-untyped-call]


@dataclass(frozen=True, slots=True)
class Messages:
    """Messages in order, as parallel columns.

    Attributes:
        channels: channel numbers.
        times: times of their publication [ns].
        contents: their bytes.
        ends: (n,) total size of all messages ever queued, up to the end of each [bytes].
        begin: that size up to the first message [bytes].
    """

    channels: list[int]
    times: list[int]
    contents: list[bytes]
    ends: NDArray[np.int64]
    begin: int

    def __len__(self) -> int:
        return len(self.contents)

    def part(self, begin: int, end: int) -> Messages:
        """Return the messages from index `begin` up to `end`."""
        part, before = slice(begin, end), int(self.ends[begin - 1]) if begin else self.begin
        return Messages(self.channels[part], self.times[part], self.contents[part], self.ends[part], before)

    def parts(self, size: int) -> Iterator[Messages]:
        """Split into parts, each of which ends as soon as it has this size [bytes]."""
        begin, before = 0, self.begin
        while begin < len(self):
            end = int(np.searchsorted(self.ends, before + size)) + 1
            part = self.part(begin, end)
            yield part
            begin, before = end, int(part.ends[-1])


class WriteQueue(Generic[R]):
    """Queue of messages to be written, with records between them.

    Attributes:
        entries: channel, time and content of each message in turn; the producer adds the three at once.
        added: size of all messages that were ever added [bytes]; counted by the producer alone.
        written: size of those that were written [bytes]; counted by the consumer alone.
    """

    def __init__(self) -> None:
        self.entries: list[Any] = []
        self.added = self.written = 0
        self._records: deque[tuple[int, R]] = deque()

    def add_record(self, record: R) -> None:
        """Add a record behind all messages that were added so far."""
        self._records.append((self.added, record))

    def take(self) -> Iterator[Messages | R]:
        """Take out what is queued, in order. What is added meanwhile is left for the next call."""
        # Copied, then deleted: each is atomic, so what another thread adds in between stays behind the head.
        entries = self.entries[:]
        del self.entries[: len(entries)]
        channels, times, contents = entries[0::3], entries[1::3], entries[2::3]
        count = len(contents)
        sizes = np.fromiter(map(len, contents), np.int64, count) + MESSAGE_OVERHEAD
        messages = Messages(channels, times, contents, self.written + np.cumsum(sizes), self.written)
        begin, end = 0, int(messages.ends[-1]) if count else self.written
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
        """Discard everything that is queued."""
        self.entries.clear()
        self._records.clear()


@dataclass(frozen=True)
class WrittenChunk:
    """A chunk: its record with its index records, its entry in the file's summary, and message counts by channel."""

    data: bytes
    index: ChunkIndex
    counts: dict[int, int]


def make_chunk(compressor: zstandard.ZstdCompressor, messages: Messages, offset: int) -> WrittenChunk:
    """Make a chunk of at least one message, at an offset in the file.

    It holds thousands of messages, so each operation covers all of them at once.
    """
    sizes = np.diff(messages.ends, prepend=messages.begin)
    heads = np.empty(len(messages), _MESSAGE)
    heads["opcode"], heads["sequence"], heads["length"] = Opcode.MESSAGE, 0, sizes - _RECORD_HEAD
    heads["channel"] = messages.channels
    heads["log_time"] = heads["publish_time"] = messages.times
    head_bytes: list[Any] = heads.view(_AS_BYTES).tolist()
    raw = b"".join(chain.from_iterable(zip(head_bytes, messages.contents, strict=True)))
    packed = compressor.compress(raw)
    first, last = int(heads["log_time"].min()), int(heads["log_time"].max())
    builder = RecordBuilder()
    Chunk(
        compression=_ZSTD,
        data=packed,
        message_start_time=first,
        message_end_time=last,
        uncompressed_crc=zlib.crc32(raw),
        uncompressed_size=len(raw),
    ).write(builder)
    length = builder.count
    offsets, counts = {}, {}
    for channel, places in _places(heads, messages.ends - sizes - messages.begin):
        offsets[channel], counts[channel] = offset + builder.count, len(places)
        size = places.nbytes
        builder.write(_INDEX.pack(Opcode.MESSAGE_INDEX, 6 + size, channel, size))
        builder.write(places.tobytes())
    index = ChunkIndex(
        chunk_start_offset=offset,
        chunk_length=length,
        compression=_ZSTD,
        compressed_size=len(packed),
        uncompressed_size=len(raw),
        message_start_time=first,
        message_end_time=last,
        message_index_length=builder.count - length,
        message_index_offsets=offsets,
    )
    return WrittenChunk(built_bytes(builder), index, counts)


def _places(heads: NDArray[np.void], places: NDArray[np.int64]) -> Iterator[tuple[int, NDArray[np.uint64]]]:
    """Return the channels of these messages, each with times and offsets in the chunk of its messages, in order."""
    table = np.empty((len(heads), 2), "<u8")
    table[:, 0], table[:, 1] = heads["log_time"], places
    # A stable sort: an index lists the messages of its channel as they stand in the chunk.
    order = np.argsort(heads["channel"], kind="stable")
    sorted_channels = heads["channel"][order]
    begins = np.flatnonzero(np.diff(sorted_channels)) + 1
    groups = np.split(table[order], begins)
    return zip(sorted_channels[[0, *begins]].tolist(), groups, strict=True)
