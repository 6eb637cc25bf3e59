"""The vacuum gripper of a cell: when it sucked, and when something hung on it."""

from __future__ import annotations

from cellwright.middleware.messages import from_cdr
from cellwright.middleware.messages.osrf_gear import VacuumGripperState
from cellwright.recording.format.reader import RecordedMessage
from cellwright.recording.plots.reading.reader import SECOND
from cellwright.recording.plots.tracks import Span


class Spans:
    """Puts together spans from a value that is told again and again."""

    def __init__(self) -> None:
        self._changes: list[tuple[float, str]] = []

    def add(self, time: float, label: str) -> None:
        """From `time` [s] on it is `label`; empty for nothing."""
        if not self._changes or self._changes[-1][1] != label:
            self._changes.append((time, label))

    def until(self, end: float) -> list[Span]:
        """The spans, the last of them until `end` [s]."""
        ends = [*(time for time, _ in self._changes[1:]), end][: len(self._changes)]
        return [Span(begin, over, label) for (begin, label), over in zip(self._changes, ends, strict=True) if label]


class Gripper:
    """Reads /ariac/gripper/state, which is told in each step: bytes that are the same again are passed over."""

    topics = ("/ariac/gripper/state",)

    def __init__(self) -> None:
        self.on, self.attached = Spans(), Spans()
        self._before = b""

    def take(self, message: RecordedMessage) -> None:
        """Take the next state."""
        if message.data == self._before:
            return
        state = from_cdr(message.data, VacuumGripperState)
        self._before = message.data
        self.on.add(message.time / SECOND, "on" if state.enabled else "")
        self.attached.add(message.time / SECOND, "attached" if state.attached else "")
