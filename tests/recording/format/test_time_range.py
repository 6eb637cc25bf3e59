"""Time range of a recording."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.recording.format.reader import RecordingFile, TimeRange
from cellwright.util.errors import UsageError
from tests.recording.format.files import write

MS = 1_000_000  # [ns] between two words of the recording


@pytest.mark.parametrize(
    ("start", "until", "times"),
    [
        (None, None, range(40)),
        (None, 3 * MS, range(4)),
        (37 * MS, None, [37, *range(37, 40)]),  # the newest latched message is repeated at the begin
        (38 * MS, 38 * MS, [38]),  # unless one is published just then
        (-MS, 10**15, range(40)),
    ],
)
def test_time_range_yields_latched_then_its_messages(
    start: int | None, until: int | None, times: list[int], tmp_path: Path
) -> None:
    write(tmp_path / "a.mcap", 40)
    with RecordingFile(tmp_path / "a.mcap") as recording:
        span = TimeRange(recording, start, until)
        found = list(span.messages(["/talk", "/shout"]))
    assert [each.time for each in found] == [time * MS for time in times]


def test_empty_time_range_is_refused(tmp_path: Path) -> None:
    write(tmp_path / "a.mcap", 40)
    with (
        RecordingFile(tmp_path / "a.mcap") as recording,
        pytest.raises(UsageError, match="no messages in this time range"),
    ):
        TimeRange(recording, 40 * MS, None)
