from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.bus import Direction
from cellwright.middleware.messages.standard import String
from cellwright.recording.format.format import RecordedTopic
from cellwright.recording.format.reader import RecordedMessage
from cellwright.recording.replay.playback import Recorded
from cellwright.util.errors import RejectedCommandError
from tests.recording.replay.memory import SECOND, TOPICS, Memory, recording, said

ORDERS, COMMAND = "/ariac/orders", "/ariac/arm/command"


def a_recording() -> Memory:
    return recording(
        4,
        said(SECOND, ORDERS, "first"),
        said(2 * SECOND, COMMAND, "left"),
        said(2 * SECOND, COMMAND, "right"),
        said(3 * SECOND, ORDERS, "second"),
    )


def test_messages_come_in_order_each_at_its_time() -> None:
    recorded = Recorded(a_recording())
    came: list[tuple[int, str, str]] = []

    def listen(topic: str) -> None:
        recorded.bus.subscribe(topic, lambda message: came.append((recorded.simulation.now, topic, message.data)))

    for topic in (ORDERS, COMMAND):
        listen(topic)

    recorded.simulation.step_until(4 * SECOND)

    assert came == [
        (SECOND, ORDERS, "first"),
        (2 * SECOND, COMMAND, "left"),
        (2 * SECOND, COMMAND, "right"),
        (3 * SECOND, ORDERS, "second"),
    ]
    assert recorded.simulation.now >= recorded.source.end_time


def test_each_message_of_a_fast_topic_comes_once() -> None:
    recorded = Recorded(a_recording())
    times: list[int] = []
    recorded.bus.subscribe("/clock", lambda message: times.append(message.clock.sec * SECOND + message.clock.nanosec))

    recorded.simulation.step_until(4 * SECOND)

    assert times == list(range(SECOND // 50, 4 * SECOND + 1, SECOND // 50)), (
        "that of the begin was before the first subscriber"
    )


def test_a_late_listener_is_given_what_is_latched() -> None:
    recorded = Recorded(a_recording())
    recorded.simulation.step_until(3 * SECOND // 2)
    came: list[Any] = []

    recorded.bus.subscribe(ORDERS, came.append)

    assert [message.data for message in came] == ["first"]


def test_topics_are_those_of_the_recording_and_all_of_them_speak() -> None:
    recorded = Recorded(a_recording())

    infos = {info.name: info for info in recorded.bus.topics()}

    assert set(infos) == {name for name, topic in TOPICS.items() if not topic.is_own}
    assert infos[COMMAND].publishers == ("/gazebo",)
    assert {info.direction for info in infos.values()} == {Direction.OUT}
    assert infos[ORDERS].latch
    assert infos[ORDERS].rate == "on event"


def test_commands_and_calls_are_refused_and_counted() -> None:
    lines: list[str] = []
    recorded = Recorded(a_recording(), report=lines.append)

    with pytest.raises(RejectedCommandError, match="this is a recording"):
        recorded.bus.publish(COMMAND, String(data="x"), node="/me")
    with pytest.raises(RejectedCommandError, match="this is a recording"):
        recorded.bus.call("/ariac/start_competition", String(data="x"), node="/me")

    assert recorded.bus.refusals.total == 2
    assert "refused /ariac/arm/command from /me: this is a recording" in lines[0]


def test_a_topic_of_an_unknown_type_is_reported_and_the_rest_is_played() -> None:
    memory = a_recording()
    memory.topics["/odd"] = RecordedTopic("/odd", "elsewhere_msgs/Odd")
    memory.list.insert(3, RecordedMessage("/odd", 0, b"\x00\x01\x00\x00"))
    lines: list[str] = []

    recorded = Recorded(memory, report=lines.append)
    recorded.simulation.step_until(SECOND)

    assert len(lines) == 1
    assert lines[0].startswith("/odd cannot be played: ")


def test_a_message_that_cannot_be_read_is_counted_and_left_out() -> None:
    memory = a_recording()
    memory.list.append(RecordedMessage(ORDERS, 4 * SECOND, b"\x00\x01\x00\x00\xff\xff\xff\x7fno"))
    recorded = Recorded(memory)
    came: list[Any] = []
    recorded.bus.subscribe(ORDERS, came.append)

    recorded.simulation.step_until(4 * SECOND)

    assert [message.data for message in came] == ["first", "second"]
    assert recorded.unreadable == 1


def test_going_back_before_the_first_order_there_is_none() -> None:
    recorded = Recorded(a_recording())
    recorded.simulation.step_until(4 * SECOND)

    recorded.seek(SECOND // 2)

    came: list[Any] = []
    recorded.bus.subscribe(ORDERS, came.append)
    assert came == []
    recorded.simulation.step_until(SECOND)
    assert [message.data for message in came] == ["first"]


def test_listeners_hear_at_once_of_a_latched_message_that_is_another_now() -> None:
    recorded = Recorded(a_recording())
    came: list[Any] = []
    recorded.bus.subscribe(ORDERS, came.append)

    for time in (7 * SECOND // 2, 7 * SECOND // 2, 3 * SECOND // 2):
        recorded.seek(time)

    assert [message.data for message in came] == ["second", "first"]


@pytest.mark.slow
@given(st.lists(st.integers(-SECOND, 6 * SECOND), min_size=1, max_size=6), st.integers(0, SECOND))
def test_whatever_was_sought_before_the_moment_looks_as_if_it_had_been_played_to(times: list[int], more: int) -> None:
    jumping, straight = Recorded(a_recording()), Recorded(a_recording())
    for time in times:
        now = jumping.seek(time)
        assert 0 <= now <= 4 * SECOND
    end = min(now + more, 4 * SECOND)

    jumping.simulation.step_until(end)
    straight.simulation.step_until(end)

    assert jumping.simulation.now == straight.simulation.now
    assert jumping.simulation.clock.tick == straight.simulation.clock.tick
    frame, other = jumping.cursor.frame(), straight.cursor.frame()
    assert frame is not None
    assert other is not None
    assert frame.encode() == other.encode()
    assert jumping.cursor.panel() == straight.cursor.panel()
    assert _latched(jumping) == _latched(straight)


def _latched(recorded: Recorded) -> list[str]:
    came: list[Any] = []
    recorded.bus.subscribe(ORDERS, came.append)
    return [message.data for message in came]
