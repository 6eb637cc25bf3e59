"""MCAP chunks: a queue of messages to be written, and the compressed, indexed chunks made of them.

Thousands of messages come a second; nothing is done for each that can be done for many. So there is no object for
a message, which the garbage collector would look at: there are three lists side by side, which are taken in one go. To
append to a list, to copy its head and to delete it are each done at once, whatever another thread is about.
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


def encoded_records(*records: McapRecord) -> bytes:
    """Records as they go to the file."""
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return built_bytes(builder)


def built_bytes(builder: RecordBuilder) -> bytes:
    """What has been built."""
    return bytes(builder.end())  # type: ignore[no-untyped-call]


R = TypeVar("R")
T = TypeVar("T")

MESSAGE_OVERHEAD = 31
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


class WriteQueue(Generic[R]):
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
        channels, times = _take_first(self.channels, count), _take_first(self.times, count)
        contents = _take_first(self.contents, count)
        sizes = np.fromiter(map(len, contents), np.int64, count) + MESSAGE_OVERHEAD
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


def _take_first(values: list[T], count: int) -> list[T]:
    """Take the first of a list out of it."""
    head = values[:count]
    del values[:count]
    return head


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
"""What stands before the bytes of a message."""

_RECORD_HEAD = 9  # bytes of opcode and length, which the length does not count
_AS_BYTES = np.dtype(("V", _MESSAGE.itemsize))
_INDEX = struct.Struct("<BQHI")  # opcode, length, channel, bytes that follow
_ZSTD = "zstd"


@dataclass(frozen=True)
class WrittenChunk:
    """A chunk: its record with those of its indexes, its entry in the file's summary, and messages by channel."""

    data: bytes
    index: ChunkIndex
    counts: dict[int, int]


def make_chunk(compressor: zstandard.ZstdCompressor, messages: Messages, offset: int) -> WrittenChunk:
    """A chunk of these messages, of which there is at least one, at a place in the file.

    There are thousands of messages in one: what is done for each is done for all at once.
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
    """The channels of these messages; for each, time and place in the chunk of its messages, in their order."""
    table = np.empty((len(heads), 2), "<u8")
    table[:, 0], table[:, 1] = heads["log_time"], places
    order = np.argsort(heads["channel"], kind="stable")
    sorted_channels = heads["channel"][order]
    begins = np.flatnonzero(np.diff(sorted_channels)) + 1
    groups = np.split(table[order], begins)
    return zip(sorted_channels[[0, *begins]].tolist(), groups, strict=True)
