"""Chunks of an MCAP file: their content and their indexes."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from itertools import accumulate

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.records import Chunk, Footer, McapRecord, Message, MessageIndex
from mcap.stream_reader import StreamReader, breakup_chunk
from zstandard import ZstdCompressor

from cellwright.recording.format.chunks import MESSAGE_OVERHEAD, WrittenChunk, encoded_records, make_chunk
from cellwright.recording.format.format import MAGIC, Entry
from tests.recording.format.test_write_queue import handed_in

entries = st.lists(
    st.tuples(st.integers(1, 65_535) | st.integers(1, 3), st.integers(0, 2**63 - 1), st.binary(max_size=20)),
    min_size=1,
    max_size=30,
)


def records(data: bytes) -> Iterator[McapRecord]:
    """Yield the records in these bytes, which end in the middle of a file."""
    end = encoded_records(Footer(0, 0, 0)) + MAGIC
    return StreamReader(BytesIO(data + end), skip_magic=True, emit_chunks=True, validate_crcs=True).records


def read(chunk: WrittenChunk) -> tuple[Chunk, list[MessageIndex]]:
    first, *indexes = records(chunk.data)
    assert isinstance(first, Chunk)
    return first, [each for each in indexes if isinstance(each, MessageIndex)]


@pytest.mark.slow
@given(entries)
def test_chunk_has_messages_in_order(given: list[Entry]) -> None:
    chunk, _ = read(make_chunk(ZstdCompressor(), handed_in(given), 0))
    found = [each for each in breakup_chunk(chunk, validate_crc=True) if isinstance(each, Message)]
    assert [(each.channel_id, each.log_time, each.data) for each in found] == given
    assert all(each.publish_time == each.log_time and each.sequence == 0 for each in found)
    times = [time for _, time, _ in given]
    assert (chunk.message_start_time, chunk.message_end_time) == (min(times), max(times))


@given(entries, st.integers(0, 1 << 40))
def test_chunk_indexes_lead_to_each_message(given: list[Entry], offset: int) -> None:
    made = make_chunk(ZstdCompressor(), handed_in(given), offset)
    chunk, indexes = read(made)
    sizes = [MESSAGE_OVERHEAD + len(data) for _, _, data in given]
    places = [end - size for end, size in zip(accumulate(sizes), sizes, strict=True)]
    assert chunk.uncompressed_size == sum(sizes)
    channels = sorted({channel for channel, _, _ in given})
    assert [each.channel_id for each in indexes] == channels
    for index in indexes:
        expected = [
            (time, place)
            for (channel, time, _), place in zip(given, places, strict=True)
            if channel == index.channel_id
        ]
        assert index.records == expected
        assert made.counts[index.channel_id] == len(expected)
    summary = made.index
    assert summary.chunk_start_offset == offset
    assert summary.chunk_length + summary.message_index_length == len(made.data)
    assert (summary.message_start_time, summary.message_end_time) == (chunk.message_start_time, chunk.message_end_time)
    assert sorted(summary.message_index_offsets) == channels
    for channel, place in summary.message_index_offsets.items():
        first = next(records(made.data[place - offset :]))
        assert isinstance(first, MessageIndex)
        assert first.channel_id == channel
