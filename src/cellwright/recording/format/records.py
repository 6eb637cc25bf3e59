"""Records of an MCAP file as bytes."""

from __future__ import annotations

from mcap.data_stream import RecordBuilder
from mcap.records import McapRecord


def written(*records: McapRecord) -> bytes:
    """Records as they go to the file."""
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return content(builder)


def content(builder: RecordBuilder) -> bytes:
    """What has been built."""
    return bytes(builder.end())  # type: ignore[no-untyped-call]
