"""Parser of untrusted files: bounds of their times, records and sizes."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import pytest
import zstandard
from mcap.records import Chunk, DataEnd

from cellwright.recording.format import format as names
from cellwright.recording.format import scan
from cellwright.recording.format.chunks import encoded_records
from cellwright.recording.format.format import RecordingHeader
from cellwright.recording.format.mcap_file import McapFile
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.format.scan import LATEST, chunk_entries
from cellwright.util.errors import RecordingError
from tests.recording.format.files import TALK, text, write


def test_message_time_beyond_any_run_is_refused(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap", 3)
    with McapFile(tmp_path / "late.mcap") as file:
        file.describe(names.METADATA, RecordingHeader("cell", "small").metadata())
        file.add(file.channel(TALK), LATEST + 1, text("late"))
    with pytest.raises(RecordingError, match="invalid times of a chunk"):
        RecordingFile(tmp_path / "late.mcap")
    late = struct.pack("<BQHIQQ", 5, 22, 1, 0, LATEST + 1, 0)
    with pytest.raises(RecordingError, match="which no run reaches"):
        list(chunk_entries(late))


def packed(path: Path, raw: bytes, chunks: int = 1) -> Path:
    """Write a recording whose chunks unpack to these bytes."""
    data = zstandard.compress(raw)
    chunk = Chunk("zstd", data, 1, 0, zlib.crc32(raw), len(raw))
    with McapFile(path) as file:
        file.describe(names.METADATA, RecordingHeader("cell", "small").metadata())
        file.channel(TALK)
    whole = path.read_bytes()
    end = whole.index(encoded_records(DataEnd(0))[:9])
    path.write_bytes(whole[:end] + chunks * encoded_records(chunk))
    return path


@pytest.mark.parametrize("record", [bytes(9), struct.pack("<BQHIQQ", 5, 22, 1, 0, 0, 0)], ids=["empty", "message"])
@pytest.mark.parametrize("chunks", [1, 3])
def test_records_are_bounded_by_size_of_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, record: bytes, chunks: int
) -> None:
    monkeypatch.setattr(scan, "MIN_RECORDS", 30_000)
    count = 30_000 // chunks
    path = packed(tmp_path / "a.mcap", record * count, chunks)
    with RecordingFile(path) as recording:
        assert len(list(recording.messages())) in (0, chunks * count)
        assert len(list(recording.messages())) in (0, chunks * count)  # nothing is counted twice
    path = packed(tmp_path / "b.mcap", record * (count + 10_000), chunks)
    for read in (lambda found: list(found.messages()), lambda found: found.counts, lambda found: found.end):
        with RecordingFile(path) as recording, pytest.raises(RecordingError, match="too many records"):
            read(recording)


def test_unpacked_size_is_bounded_by_size_of_file(tmp_path: Path) -> None:
    path = packed(tmp_path / "a.mcap", bytes(100 << 20), 3)
    with pytest.raises(RecordingError, match="unpacks to more than 1000 times its size"):
        RecordingFile(path)
