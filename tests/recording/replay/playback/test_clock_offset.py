from __future__ import annotations

from typing import Any

import pytest

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.conversions import joint_state
from cellwright.recording.format.format import RecordedTopic, RecordingHeader
from cellwright.recording.format.reader import RecordedMessage
from cellwright.recording.replay.playback import Recorded, clock_offset
from tests.recording.replay.memory import SECOND, Memory, recording, text_message

STATES = "/io_teleop/joint_states"
WALL = 1_700_000_000 * SECOND  # [ns]


def of_robot(ahead: int) -> Memory:
    """Return a second of a robot with message stamps of another clock."""
    states = [
        RecordedMessage(STATES, time, TYPES.to_cdr(joint_state(["a"], [0.0], time=time + ahead)))
        for time in range(0, SECOND + 1, SECOND // 100)
    ]
    topics = {STATES: RecordedTopic(STATES, "sensor_msgs/JointState")}
    return Memory(states, topics, RecordingHeader("robot", "tandem", {"timestep": [1, 240]}))


@pytest.mark.parametrize(("ahead", "found"), [(WALL, WALL), (0, 0), (2_000_000, 0)])
def test_clock_offset_is_found_from_stamps(ahead: int, found: int) -> None:
    assert clock_offset(of_robot(ahead)) == found


def test_messages_without_stamps_give_zero_offset() -> None:
    assert (
        clock_offset(
            Memory([text_message(0, "/ariac/orders", "x"), text_message(1, "/ariac/orders", "y")._replace(data=b"?")])
        )
        == 0
    )


def test_recording_without_clock_is_played_with_clock() -> None:
    recorded = Recorded(of_robot(WALL))
    received: list[Any] = []
    recorded.bus.subscribe("/clock", received.append)

    recorded.simulation.step_until(SECOND)

    times = [message.clock.sec * SECOND + message.clock.nanosec - WALL for message in received]
    assert len(times) == 100
    assert times == sorted(times)
    assert times[-1] == SECOND


def test_recorded_clock_has_one_publisher() -> None:
    recorded = Recorded(recording(1))

    assert recorded.bus.topic("/clock").publishers == ("/gazebo",)
