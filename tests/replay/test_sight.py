from __future__ import annotations

from cellwright.replay.sight import Sight
from cellwright.replay.source import FRAME, PANEL, Entry
from tests.replay.memory import SECOND, Memory, frame_at, recording


def test_a_frame_is_that_of_the_moment() -> None:
    sight = Sight(recording(3))

    sight.seek(7 * SECOND // 5)

    frame = sight.frame()
    assert frame is not None
    assert frame.encode() == frame_at(7 * SECOND // 5).encode()
    assert sight.panel() == {"half": 2}


def test_without_frames_there_is_none() -> None:
    sight = Sight(Memory([]))

    sight.seek(0)

    assert sight.frame() is None
    assert sight.panel() == {}


def test_a_whole_frame_is_looked_for_far_back() -> None:
    memory = recording(60)
    memory.list = [e for e in memory.list if e.channel != FRAME or e.time == 0 or len(e.data) < 80]
    sight = Sight(memory)

    sight.seek(60 * SECOND)

    frame = sight.frame()
    assert frame is not None
    assert frame.poses[1, 0] == frame_at(60 * SECOND - SECOND // 25).poses[1, 0]


def test_a_damaged_frame_costs_what_follows_until_the_next_whole_one() -> None:
    memory = recording(2)
    memory.list = [
        e._replace(data=b"\x01nonsense") if e.channel == FRAME and e.time == SECOND // 2 else e for e in memory.list
    ]
    sight = Sight(memory)

    sight.seek(2 * SECOND)

    frame = sight.frame()
    assert frame is not None
    assert frame.encode() == frame_at(2 * SECOND).encode()


def test_a_panel_that_is_no_object_shows_nothing() -> None:
    sight = Sight(Memory([Entry(0, PANEL, b"[1]"), Entry(1, PANEL, b"{")]))

    for time in (0, 1):
        sight.seek(time)
        assert sight.panel() == {}
