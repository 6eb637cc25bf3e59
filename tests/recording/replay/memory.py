"""In-memory recording, for tests of playback."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from functools import cached_property
from pathlib import Path

import numpy as np

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.standard import Clock, String, Time
from cellwright.recording.format.format import FRAME, OWN_TOPICS, PANEL, RecordedTopic, RecordingHeader
from cellwright.recording.format.reader import RecordedMessage, RecordingFile
from cellwright.rendering.scene.scene import SceneFrame

SECOND = 1_000_000_000
BODIES = 3
HEADER = RecordingHeader("cell", "lesson", {"timestep": "1/500"})

TOPICS = {
    topic.name: topic
    for topic in (
        RecordedTopic("/clock", "rosgraph_msgs/Clock", rate="each step", node="/gazebo"),
        RecordedTopic("/ariac/orders", "std_msgs/String", rate="on event", latch=True, node="/gazebo"),
        RecordedTopic("/ariac/arm/command", "std_msgs/String", "in", node="/gazebo"),
        *(RecordedTopic(name, kind) for name, kind in OWN_TOPICS.items()),
    )
}


class Memory(RecordingFile):
    """Recording of messages in the order of their times."""

    def __init__(
        self,
        messages: list[RecordedMessage],
        topics: dict[str, RecordedTopic] = TOPICS,
        header: RecordingHeader = HEADER,
    ) -> None:
        self.path = Path("memory")
        self.list = messages
        self.topics = dict(topics)
        self.header, self.types = header, TYPES
        self.encoded_scene: bytes | None = None

    @property
    def scene(self) -> bytes | None:
        """The encoded scene."""
        return self.encoded_scene

    @property
    def begin(self) -> int:
        """Time of its begin [ns]."""
        return 0

    @cached_property
    def end_time(self) -> int:
        """Time of the last message [ns]."""
        return self.list[-1].time if self.list else 0

    def messages(
        self, topics: Collection[str] | None = None, *, start: int | None = None, until: int | None = None
    ) -> Iterator[RecordedMessage]:
        """Yield messages of some topics, or of all, between two times."""
        first, last = 0 if start is None else start, self.end_time + 1 if until is None else until
        return (e for e in self.list if first <= e.time < last and (topics is None or e.topic in topics))

    def newest(self, topic: str, time: int) -> RecordedMessage | None:
        """Return the newest message of a topic at a time."""
        found = [e for e in self.list if e.topic == topic and e.time <= time]
        return found[-1] if found else None


def text_message(time: int, topic: str, text: str) -> RecordedMessage:
    """Return a text on a topic at a time [ns]."""
    return RecordedMessage(topic, time, TYPES.to_cdr(String(data=text)))


def frame_message(time: int, data: bytes) -> RecordedMessage:
    """Return a frame's bytes at a time [ns]."""
    layout = TYPES.message("std_msgs/MultiArrayLayout")([], 0)  # type: ignore[call-arg]
    carrier = TYPES.message("std_msgs/UInt8MultiArray")
    return RecordedMessage(FRAME, time, TYPES.to_cdr(carrier(layout, np.frombuffer(data, np.uint8))))  # type: ignore[call-arg]


def frame_at(time: int) -> SceneFrame:
    """Return a frame with the second body at x = time [m for s]; the third is visible in odd seconds."""
    poses = np.zeros((BODIES, 7), np.float32)
    poses[:, 3] = 1.0
    poses[1, 0] = time / SECOND
    return SceneFrame(time, poses, np.array([True, True, time // SECOND % 2 == 1]))


def frames(until: int) -> list[RecordedMessage]:
    """Return frames, 25 a second, up to a time [ns]; a whole one each second."""
    found, before = [], None
    for number in range(until // (SECOND // 25) + 1):
        frame = frame_at(number * SECOND // 25)
        found.append(frame_message(frame.time, frame.encode(None if number % 25 == 0 else before)))
        before = frame
    return found


def panels(until: int) -> list[RecordedMessage]:
    """Return panels, two a second, with the number of half seconds."""
    return [text_message(n * SECOND // 2, PANEL, f'{{"half": {n}}}') for n in range(2 * until // SECOND + 1)]


def recording(seconds: int, *more: RecordedMessage) -> Memory:
    """Return a recording with clock, frames, panels and further messages."""
    ticks = [
        RecordedMessage("/clock", t, TYPES.to_cdr(Clock(clock=Time(sec=t // SECOND, nanosec=t % SECOND))))
        for t in range(0, seconds * SECOND + 1, SECOND // 50)
    ]
    entries = [*ticks, *frames(seconds * SECOND), *panels(seconds * SECOND), *more]
    return Memory(sorted(entries, key=lambda entry: entry.time))
