"""Header of a recording: what it keeps, and what an invalid one counts as."""

import pytest

from cellwright.recording.format.format import RecordingHeader


@pytest.mark.parametrize("value", [None, True, -1, 1.5, "1", 1 << 62, [1]])
def test_invalid_clock_offset_in_header_counts_as_none(value: object) -> None:
    header = RecordingHeader("cell", "a", {"clock_offset": value})
    assert RecordingHeader.of(header.metadata()).clock_offset == 0


def test_clock_offset_is_kept_in_header() -> None:
    header = RecordingHeader("cell", "a", {"seed": 1})
    assert header.with_clock_offset(0) == header
    assert RecordingHeader.of(header.with_clock_offset(5).metadata()).clock_offset == 5
