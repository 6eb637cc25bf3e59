"""A number of messages as one chunk of an MCAP file, with its indexes."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Chunk, ChunkIndex

from cellwright.recording.format import Entry
from cellwright.recording.records import content

_MESSAGE = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time
_MESSAGE_FIELDS = _MESSAGE.size - 9  # what the length counts of them
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
    """Makes chunks, compressed so lightly that it costs next to nothing."""

    def __init__(self) -> None:
        self._compressor = zstandard.ZstdCompressor(level=1)

    def make(self, entries: Sequence[Entry], offset: int) -> WrittenChunk:
        """A chunk of these messages, of which there is at least one, at a place in the file."""
        parts: list[bytes] = []
        places: dict[int, list[int]] = {}  # by channel: time and place in the chunk, in turn
        place = 0
        pack = _MESSAGE.pack
        for channel, time, data in entries:
            size = _MESSAGE_FIELDS + len(data)
            parts += (pack(Opcode.MESSAGE, size, channel, 0, time, time), data)
            if channel not in places:
                places[channel] = []
            places[channel] += (time, place)
            place += size + 9
        raw = b"".join(parts)
        packed = self._compressor.compress(raw)
        times = [time for _, time, _ in entries]
        builder = RecordBuilder()
        Chunk(
            compression=_ZSTD,
            data=packed,
            message_start_time=min(times),
            message_end_time=max(times),
            uncompressed_crc=zlib.crc32(raw),
            uncompressed_size=len(raw),
        ).write(builder)
        length = builder.count
        offsets = {}
        for channel, flat in places.items():
            offsets[channel] = offset + builder.count
            size = 8 * len(flat)
            builder.write(struct.pack(f"<BQHI{len(flat)}Q", Opcode.MESSAGE_INDEX, 6 + size, channel, size, *flat))
        index = ChunkIndex(
            chunk_start_offset=offset,
            chunk_length=length,
            compression=_ZSTD,
            compressed_size=len(packed),
            uncompressed_size=len(raw),
            message_start_time=min(times),
            message_end_time=max(times),
            message_index_length=builder.count - length,
            message_index_offsets=offsets,
        )
        return WrittenChunk(content(builder), index, {channel: len(flat) // 2 for channel, flat in places.items()})
