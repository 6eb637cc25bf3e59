"""A recording that is a list, for tests of what plays one."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cellwright.bus import Direction
from cellwright.messages import to_cdr
from cellwright.messages.standard import Clock, String, Time
from cellwright.replay.source import FRAME, PANEL, Entry, RecordedTopic
from cellwright.scene.frame import Frame

SECOND = 1_000_000_000
BODIES = 3

TOPICS = (
    RecordedTopic("/clock", "rosgraph_msgs/Clock", rate="each step", node="/gazebo"),
    RecordedTopic("/ariac/orders", "std_msgs/String", rate="on event", latch=True, node="/gazebo"),
    RecordedTopic("/ariac/arm/command", "std_msgs/String", Direction.IN, node="/agent"),
)


@dataclass
class Memory:
    """Entries in the order of their times."""

    list: list[Entry]
    topics: tuple[RecordedTopic, ...] = TOPICS
    name: str = "lesson"
    header: Mapping[str, Any] = field(default_factory=lambda: {"timestep": "1/500"})
    scene: bytes = b""
    begin: int = 0

    @property
    def end(self) -> int:
        """When the last entry was written [ns]."""
        return self.list[-1].time if self.list else 0

    def entries(self, channels: Collection[str] | None = None, start: int = 0) -> Iterator[Entry]:
        """Entries of some channels, or of all, from a time on."""
        return (e for e in self.list if e.time >= start and (channels is None or e.channel in channels))

    def newest(self, channel: str, time: int) -> Entry | None:
        """The newest of a channel by a time."""
        found = [e for e in self.list if e.channel == channel and e.time <= time]
        return found[-1] if found else None


def said(time: int, topic: str, text: str) -> Entry:
    """A text on a topic at a time [ns]."""
    return Entry(time, topic, to_cdr(String(data=text)))


def frame_at(time: int) -> Frame:
    """A frame in which the second body has come as far [m] as time has [s]; the third is there in odd seconds."""
    poses = np.zeros((BODIES, 7), np.float32)
    poses[:, 3] = 1.0
    poses[1, 0] = time / SECOND
    return Frame(time, poses, np.array([True, True, time // SECOND % 2 == 1]))


def frames(until: int) -> list[Entry]:
    """Frames of 25 a second up to a time [ns], whole ones each second."""
    found, before = [], None
    for number in range(until // (SECOND // 25) + 1):
        frame = frame_at(number * SECOND // 25)
        found.append(Entry(frame.time, FRAME, frame.encode(None if number % 25 == 0 else before)))
        before = frame
    return found


def panels(until: int) -> list[Entry]:
    """Twice a second what the panel shows: how many half seconds have passed."""
    return [Entry(n * SECOND // 2, PANEL, b'{"half": %d}' % n) for n in range(2 * until // SECOND + 1)]


def recording(seconds: int, *more: Entry) -> Memory:
    """A recording with clock, frames, panels and whatever else."""
    ticks = [
        Entry(t, "/clock", to_cdr(Clock(clock=Time(sec=t // SECOND, nanosec=t % SECOND))))
        for t in range(0, seconds * SECOND + 1, SECOND // 50)
    ]
    entries = [*ticks, *frames(seconds * SECOND), *panels(seconds * SECOND), *more]
    return Memory(sorted(entries, key=lambda entry: entry.time))
