"""Times of commands, by name."""

import json

from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.bus import InputKind
from cellwright.middleware.messages.standard import String
from cellwright.recording.format.commands import Command
from cellwright.recording.plots.reading.reader import CommandReader
from cellwright.util.errors import printable
from tests.recording.plots.reading.recordings import message


@given(st.lists(st.text(min_size=1, max_size=20)))
def test_reader_collects_times_by_command_name(called: list[str]) -> None:
    reader, expected = CommandReader(), dict[str, list[float]]()
    for time, name in enumerate(called):
        reader.take(message(time, String(data=json.dumps({"tick": 3, "name": name, "data": "x" * 9}))))
        expected.setdefault(printable(name, 200), []).append(float(time))
    assert {track.name: track.times.tolist() for track in reader.tracks()} == expected


def test_encoded_command_gives_track_of_its_name() -> None:
    reader = CommandReader()
    command = Command(
        tick=7, kind=InputKind.PUBLISH, name="/ariac/arm/command", type="a/B", node="/agent", data=b"{}", stamp=1
    )
    reader.take(message(0.5, String(data=command.encode())))
    (track,) = reader.tracks()
    assert (track.name, track.times.tolist()) == ("/ariac/arm/command", [0.5])


def test_invalid_command_is_skipped() -> None:
    reader = CommandReader()
    reader.take(message(0.0, String(data="nothing")))
    assert reader.tracks() == []
