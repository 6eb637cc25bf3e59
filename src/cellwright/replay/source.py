"""What playing needs of a recording, whatever it is kept in."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from cellwright.bus import Direction

FRAME = "/cellwright/frame"
"""Channel of what was to be seen: the bytes of a `Frame`."""
PANEL = "/cellwright/panel"
"""Channel of what the panel showed: JSON."""


class Entry(NamedTuple):
    """One entry: when it was written [ns of simulation time], to which channel, and its bytes."""

    time: int
    channel: str
    data: bytes


@dataclass(frozen=True, slots=True)
class RecordedTopic:
    """A topic as it stood when it was recorded.

    Attributes:
        name: its name, which is that of its channel.
        type: short name of its messages' type.
        direction: out of what was recorded, or into it.
        rate: how often messages came, in words.
        latch: whether late listeners were given the newest.
        node: who published on it.
        count: how many messages there are.
    """

    name: str
    type: str
    direction: Direction = Direction.OUT
    rate: str = ""
    latch: bool = False
    node: str = ""
    count: int = 0


class Source(Protocol):
    """Something recorded: a file, or a list in a test. Entries are in the order of their times."""

    @property
    def name(self) -> str:
        """Of the trial or the robot."""
        ...

    @property
    def header(self) -> Mapping[str, Any]:
        """What the run was, as JSON values."""
        ...

    @property
    def begin(self) -> int:
        """Simulation time [ns] of its begin."""
        ...

    @property
    def end(self) -> int:
        """Simulation time [ns] of its last entry."""
        ...

    @property
    def topics(self) -> Sequence[RecordedTopic]:
        """The topics, in both directions."""
        ...

    @property
    def scene(self) -> bytes:
        """What there is to be seen, encoded; empty where that is missing."""
        ...

    def entries(self, channels: Collection[str] | None = None, start: int = 0) -> Iterator[Entry]:
        """All entries of some channels, or of all, from the time `start` [ns] on."""
        ...

    def newest(self, channel: str, time: int) -> Entry | None:
        """The newest entry of a channel at or before `time` [ns]; None when there is none yet."""
        ...
