from __future__ import annotations

from cellwright.recording.format.format import FRAME, PANEL
from cellwright.recording.format.reader import frame_bytes
from cellwright.recording.replay.frame_cursor import FrameCursor
from cellwright.rendering.scene.scene import is_whole_frame
from tests.recording.replay.memory import SECOND, Memory, frame_at, frame_message, recording, text_message


def test_frame_and_panel_are_newest_at_time() -> None:
    cursor = FrameCursor(recording(3))

    cursor.seek(7 * SECOND // 5)

    frame = cursor.frame()
    assert frame is not None
    assert frame.encode() == frame_at(7 * SECOND // 5).encode()
    assert cursor.panel() == {"half": 2}


def test_recording_without_frames_gives_none() -> None:
    cursor = FrameCursor(Memory([]))

    cursor.seek(0)

    assert cursor.frame() is None
    assert cursor.panel() == {}


def test_distant_whole_frame_is_found() -> None:
    memory = recording(60)
    memory.list = [
        each
        for each in memory.list
        if each.topic != FRAME or each.time == 0 or not is_whole_frame(frame_bytes(each.data))
    ]
    cursor = FrameCursor(memory)

    cursor.seek(60 * SECOND)

    frame = cursor.frame()
    assert frame is not None
    assert frame.poses[1, 0] == frame_at(60 * SECOND - SECOND // 25).poses[1, 0]


def test_damaged_frame_is_skipped_until_next_whole_frame() -> None:
    memory = recording(2)
    damaged = frame_message(SECOND // 2, b"\x01nonsense")
    index = next(n for n, each in enumerate(memory.list) if each.topic == FRAME and each.time > SECOND // 2)
    memory.list.insert(index, damaged)
    memory.list.append(memory.list[-1]._replace(topic=FRAME, data=b"no message at all"))
    cursor = FrameCursor(memory)

    cursor.seek(2 * SECOND)

    frame = cursor.frame()
    assert frame is not None
    assert frame.encode() == frame_at(2 * SECOND).encode()


def test_panel_that_is_no_object_is_empty() -> None:
    cursor = FrameCursor(
        Memory(
            [text_message(0, PANEL, "[1]"), text_message(1, PANEL, "{"), text_message(2, PANEL, "")._replace(data=b"?")]
        )
    )

    for time in (0, 1, 2):
        cursor.seek(time)
        assert cursor.panel() == {}
