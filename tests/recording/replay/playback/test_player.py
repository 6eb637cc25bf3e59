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
from tests.recording.replay.memory import SECOND, TOPICS, Memory, recording, text_message

ORDERS, COMMAND = "/ariac/orders", "/ariac/arm/command"


def a_recording() -> Memory:
    return recording(
        4,
        text_message(SECOND, ORDERS, "first"),
        text_message(2 * SECOND, COMMAND, "left"),
        text_message(2 * SECOND, COMMAND, "right"),
        text_message(3 * SECOND, ORDERS, "second"),
    )


def test_messages_are_published_in_order_at_their_times() -> None:
    recorded = Recorded(a_recording())
    received: list[tuple[int, str, str]] = []

    def listen(topic: str) -> None:
        recorded.bus.subscribe(topic, lambda message: received.append((recorded.simulation.now, topic, message.data)))

    for topic in (ORDERS, COMMAND):
        listen(topic)

    recorded.simulation.step_until(4 * SECOND)

    assert received == [
        (SECOND, ORDERS, "first"),
        (2 * SECOND, COMMAND, "left"),
        (2 * SECOND, COMMAND, "right"),
        (3 * SECOND, ORDERS, "second"),
    ]
    assert recorded.simulation.now >= recorded.source.end_time


def test_message_of_fast_topic_is_published_once() -> None:
    recorded = Recorded(a_recording())
    times: list[int] = []
    recorded.bus.subscribe("/clock", lambda message: times.append(message.clock.sec * SECOND + message.clock.nanosec))

    recorded.simulation.step_until(4 * SECOND)

    assert times == list(range(SECOND // 50, 4 * SECOND + 1, SECOND // 50)), (
        "that of the begin was before the first subscriber"
    )


def test_late_subscriber_gets_latched_message() -> None:
    recorded = Recorded(a_recording())
    recorded.simulation.step_until(3 * SECOND // 2)
    received: list[Any] = []

    recorded.bus.subscribe(ORDERS, received.append)

    assert [message.data for message in received] == ["first"]


def test_topics_equal_recorded_topics_and_have_publishers() -> None:
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

    with pytest.raises(RejectedCommandError, match="a recording is read-only"):
        recorded.bus.publish(COMMAND, String(data="x"), node="/me")
    with pytest.raises(RejectedCommandError, match="a recording is read-only"):
        recorded.bus.call("/ariac/start_competition", String(data="x"), node="/me")

    assert recorded.bus.refusals.total == 2
    assert "refused /ariac/arm/command from /me: a recording is read-only" in lines[0]


def test_topic_of_unknown_type_is_reported_and_rest_is_played() -> None:
    memory = a_recording()
    memory.topics["/odd"] = RecordedTopic("/odd", "elsewhere_msgs/Odd")
    memory.list.insert(3, RecordedMessage("/odd", 0, b"\x00\x01\x00\x00"))
    lines: list[str] = []

    recorded = Recorded(memory, report=lines.append)
    recorded.simulation.step_until(SECOND)

    assert len(lines) == 1
    assert lines[0].startswith("/odd cannot be played: ")


def test_unreadable_message_is_counted_and_left_out() -> None:
    memory = a_recording()
    memory.list.append(RecordedMessage(ORDERS, 4 * SECOND, b"\x00\x01\x00\x00\xff\xff\xff\x7fno"))
    recorded = Recorded(memory)
    received: list[Any] = []
    recorded.bus.subscribe(ORDERS, received.append)

    recorded.simulation.step_until(4 * SECOND)

    assert [message.data for message in received] == ["first", "second"]
    assert recorded.unreadable == 1


def test_seek_before_first_latched_message_clears_it() -> None:
    recorded = Recorded(a_recording())
    recorded.simulation.step_until(4 * SECOND)

    recorded.seek(SECOND // 2)

    received: list[Any] = []
    recorded.bus.subscribe(ORDERS, received.append)
    assert received == []
    recorded.simulation.step_until(SECOND)
    assert [message.data for message in received] == ["first"]


def test_seek_publishes_changed_latched_message_at_once() -> None:
    recorded = Recorded(a_recording())
    received: list[Any] = []
    recorded.bus.subscribe(ORDERS, received.append)

    for time in (7 * SECOND // 2, 7 * SECOND // 2, 3 * SECOND // 2):
        recorded.seek(time)

    assert [message.data for message in received] == ["second", "first"]


@pytest.mark.slow
@given(st.lists(st.integers(-SECOND, 6 * SECOND), min_size=1, max_size=6), st.integers(0, SECOND))
def test_state_after_seeks_equals_state_after_playing(times: list[int], more: int) -> None:
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
    received: list[Any] = []
    recorded.bus.subscribe(ORDERS, received.append)
    return [message.data for message in received]
