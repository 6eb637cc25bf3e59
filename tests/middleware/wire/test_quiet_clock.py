"""Repetition of the time by a bridge while the cell publishes none."""

from __future__ import annotations

import json
from typing import Any

from cellwright.middleware.wire.frames import Frame, FrameKind
from cellwright.middleware.wire.quiet_clock import PERIOD, TIME, QuietClock


class Parts:
    """Loop, link and publisher of a clock; time passes by `look`."""

    def __init__(self) -> None:
        self.due: list[Any] = []
        self.asked: list[Any] = []
        self.published: list[int] = []
        self.is_wanted = True
        self.loop = self
        self.clock = QuietClock(self, self.published.append, lambda: self.is_wanted)  # type: ignore[arg-type]

    def later(self, delay: float, function: Any) -> None:
        assert delay == PERIOD
        self.due.append(function)

    def request(self, kind: FrameKind, answered: Any, **fields: Any) -> int:
        assert (kind, fields) == (FrameKind.CALL, {"name": TIME, "payload": b"{}"})
        self.asked.append(answered)
        return len(self.asked)

    def look(self) -> None:
        (function,), self.due = self.due, []
        function()

    def answer(self, time: int) -> None:
        self.asked.pop(0)(Frame(FrameKind.ANSWER, payload=json.dumps({"time": time}).encode()))


def test_time_that_stands_is_repeated() -> None:
    parts = Parts()
    parts.look()
    for time in (0, 0, 5_000_000_000):
        parts.look()
        parts.answer(time)
    assert parts.published == [0, 0, 5_000_000_000]


def test_time_that_passes_is_not_asked_for() -> None:
    parts = Parts()
    for _ in range(3):
        parts.clock.note()
        parts.look()
    assert not parts.asked


def test_answer_that_is_older_than_a_message_is_dropped() -> None:
    parts = Parts()
    parts.look()
    parts.look()
    parts.clock.note()
    parts.answer(1)
    assert not parts.published


def test_refusal_and_lack_of_subscribers_publish_nothing() -> None:
    parts = Parts()
    parts.is_wanted = False
    parts.look()
    parts.look()
    assert not parts.asked
    parts.is_wanted = True
    parts.look()
    parts.asked.pop()(Frame(FrameKind.REFUSED))
    assert not parts.published
