"""A number of messages as one chunk of an MCAP file, with its indexes."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Chunk, ChunkIndex
from numpy.typing import NDArray

from cellwright.recording.format.records import content
from cellwright.recording.format.waiting import Messages

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

_HEAD = 9  # bytes of opcode and length, which the length does not count
_AS_BYTES = np.dtype(("V", _MESSAGE.itemsize))
_INDEX = struct.Struct("<BQHI")  # opcode, length, channel, bytes that follow
_ZSTD = "zstd"


@dataclass(frozen=True)
class WrittenChunk:
    """A chunk as it goes to the file, and what the file's summary says of it.

    Attributes:
        data: the record of the chunk and those of its indexes.
        index: its entry in the summary.
        counts: messages by channel.
    """

    data: bytes
    index: ChunkIndex
    counts: dict[int, int]


class ChunkMaker:
    """Makes chunks, compressed so lightly that it costs next to nothing.

    There are thousands of messages in one: what is done for each is done for all at once.
    """

    def __init__(self) -> None:
        self._compressor = zstandard.ZstdCompressor(level=1)

    def make(self, messages: Messages, offset: int) -> WrittenChunk:
        """A chunk of these messages, of which there is at least one, at a place in the file."""
        sizes = np.diff(messages.ends, prepend=messages.begin)
        heads = np.empty(len(messages), _MESSAGE)
        heads["opcode"], heads["sequence"], heads["length"] = Opcode.MESSAGE, 0, sizes - _HEAD
        heads["channel"] = messages.channels
        heads["log_time"] = heads["publish_time"] = messages.times
        head_bytes: list[Any] = heads.view(_AS_BYTES).tolist()
        raw = b"".join(chain.from_iterable(zip(head_bytes, messages.contents, strict=True)))
        packed = self._compressor.compress(raw)
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
        return WrittenChunk(content(builder), index, counts)


def _places(heads: NDArray[np.void], places: NDArray[np.int64]) -> Iterator[tuple[int, NDArray[np.uint64]]]:
    """The channels of these messages; for each, time and place in the chunk of its messages, in their order."""
    table = np.empty((len(heads), 2), "<u8")
    table[:, 0], table[:, 1] = heads["log_time"], places
    order = np.argsort(heads["channel"], kind="stable")
    sorted_channels = heads["channel"][order]
    begins = np.flatnonzero(np.diff(sorted_channels)) + 1
    groups = np.split(table[order], begins)
    return zip(sorted_channels[[0, *begins]].tolist(), groups, strict=True)
