"""The end of an MCAP file: what is in it and where, so that others find their way without reading it all."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, field

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    McapRecord,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from cellwright.recording.format.format import MAGIC
from cellwright.recording.format.records import content, written


@dataclass
class Summary:
    """What is in a file so far."""

    schemas: list[Schema] = field(default_factory=list)
    channels: list[Channel] = field(default_factory=list)
    chunks: list[ChunkIndex] = field(default_factory=list)
    attachments: list[AttachmentIndex] = field(default_factory=list)
    metadata: list[MetadataIndex] = field(default_factory=list)
    counts: dict[int, int] = field(default_factory=dict)
    """Messages by channel."""

    def count(self, more: dict[int, int]) -> None:
        """Count messages."""
        for channel, number in more.items():
            self.counts[channel] = self.counts.get(channel, 0) + number

    def encode(self, offset: int, checksum: int) -> bytes:
        """The end of the file, which begins at `offset` in it; `checksum` is the CRC-32 of all before."""
        head = written(DataEnd(checksum))
        builder = RecordBuilder()
        start = offset + len(head)
        groups: list[tuple[Opcode, list[McapRecord]]] = [
            (Opcode.SCHEMA, [*self.schemas]),
            (Opcode.CHANNEL, [*self.channels]),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, [*self.chunks]),
            (Opcode.ATTACHMENT_INDEX, [*self.attachments]),
            (Opcode.METADATA_INDEX, [*self.metadata]),
        ]
        offsets = []
        for opcode, records in groups:
            begin = builder.count
            for record in records:
                record.write(builder)
            if records:
                offsets.append(SummaryOffset(opcode, start + begin, builder.count - begin))
        offsets_start = start + builder.count
        for each in offsets:
            each.write(builder)
        body = content(builder)
        places = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offsets_start)
        footer = Footer(start, offsets_start, zlib.crc32(places, zlib.crc32(body)))
        return head + body + written(footer) + MAGIC

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=len(self.attachments),
            channel_count=len(self.channels),
            channel_message_counts=self.counts,
            chunk_count=len(self.chunks),
            message_count=sum(self.counts.values()),
            metadata_count=len(self.metadata),
            message_start_time=min((each.message_start_time for each in self.chunks), default=0),
            message_end_time=max((each.message_end_time for each in self.chunks), default=0),
            schema_count=len(self.schemas),
        )
