"""Commands on their way to the cell: a window, a bounded queue behind it, and steps that wait for them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.wire.command_queue import WINDOW, CommandQueue, Step, StepQueue, refusal_line
from cellwright.middleware.wire.frames import SAID, Frame, FrameKind, read_advance, time_frame


class Link:
    """Link to a cell that answers when it is asked to."""

    def __init__(self) -> None:
        self.requests: list[tuple[FrameKind, Any, dict[str, Any]]] = []

    def request(self, kind: FrameKind, answered: Callable[[Frame], None], **fields: Any) -> int:
        self.requests.append((kind, answered, fields))
        return len(self.requests)

    @property
    def payloads(self) -> list[bytes]:
        return [fields["payload"] for _, _, fields in self.requests]

    def answer(self, number: int, frame: Frame) -> None:
        """Answer the request of this number, from 0."""
        self.requests[number][1](frame)


class Loop:
    """Loop without time, which reports nothing."""

    def call(self, *_: Any) -> None:
        """Leave it."""

    def later(self, *_: Any) -> None:
        """Leave it."""


LOOP: Any = Loop()


def queue_of(link: Any, **options: Any) -> CommandQueue:
    return CommandQueue(LOOP, link, "/command", "std_msgs/String", **options)


DONE = Frame(FrameKind.DONE, 1)


@given(st.integers(0, 3 * WINDOW), st.integers(1, WINDOW))
def test_newest_messages_arrive_in_order_behind_a_window(count: int, limit: int) -> None:
    link = Link()
    queue = queue_of(link, limit=limit)
    sent = [b"%d" % number for number in range(count)]
    for data in sent:
        queue.take("/node", data)
    assert link.payloads == sent[:WINDOW]
    number = 0
    while number < len(link.requests):
        link.answer(number, DONE)
        number += 1
    assert link.payloads == sent[:WINDOW] + sent[WINDOW:][-limit:]


def test_dropped_messages_count_as_handed_over_in_lockstep() -> None:
    link = Link()
    queue = queue_of(link, limit=1, on_handed_over=lambda: None)
    for _ in range(WINDOW + 3):
        queue.take("/node", b"")
    assert queue.handed_over("/node") == WINDOW + 2  # the newest one waits
    queue.take("/node", b"", connection="another")
    assert queue.handed_over("/node") == WINDOW + 3


def test_refusal_that_the_cell_has_said_is_logged_with_its_sender() -> None:
    link, lines = Link(), list[str]()
    queue = queue_of(link, log=lines.append)
    queue.take("/node", b"", name="/their/command")
    link.answer(0, Frame(FrameKind.REFUSED, 1, name="MessageError", type=SAID, payload=b"no joint\n named x"))
    assert lines == ["refused /their/command from /node: no joint named x"]


@pytest.mark.parametrize("frame", [DONE, Frame(FrameKind.REFUSED, 1, payload=b"counted only")])
def test_answer_that_refuses_nothing_new_has_no_line(frame: Frame) -> None:
    assert refusal_line(frame, "/command") == ""


def steps(link: Any, topics: dict[str, CommandQueue]) -> tuple[StepQueue, list[tuple[str, int]]]:
    return StepQueue(LOOP, link, topics), []


def test_step_waits_for_the_messages_of_its_caller() -> None:
    link = Link()
    queue = queue_of(link, on_handed_over=lambda: None)
    waiting, ended = steps(link, {"/command": queue})
    waiting.add(Step("/node", 10, {"/command": 1}, lambda *end: ended.append(end)))
    assert link.requests == []
    queue.take("/node", b"")
    waiting.look()
    kinds = [kind for kind, _, _ in link.requests]
    assert kinds == [FrameKind.PUBLISH, FrameKind.ADVANCE]
    link.answer(1, time_frame(2, 100))  # the present time: its end is 10 ns later
    assert read_advance(Frame(FrameKind.ADVANCE, 3, payload=link.payloads[2])) == (110, False)
    link.answer(2, time_frame(3, 112))
    assert ended == [("", 112)]


@pytest.mark.parametrize(
    ("step", "reason"),
    [
        ({"duration": -1_000_000}, "duration must not be negative (got -0.001 s)"),
        ({"published": {"/other": 2}}, "the cell does not subscribe to /other (known: /command)"),
    ],
)
def test_step_that_cannot_be_is_refused_at_once(step: dict[str, Any], reason: str) -> None:
    link = Link()
    waiting, ended = steps(link, {"/command": queue_of(link)})
    values: dict[str, Any] = {"duration": 1, "published": {}} | step
    waiting.add(Step("/node", values["duration"], values["published"], lambda *end: ended.append(end)))
    assert ended == [(reason, 0)]
    assert link.requests == []


def test_next_step_begins_when_the_one_before_has_failed() -> None:
    link = Link()
    waiting, ended = steps(link, {})
    for caller in ("/a", "/b"):
        waiting.add(Step(caller, 1, {}, lambda *end: ended.append(end)))
    assert len(link.requests) == 1
    link.answer(0, Frame(FrameKind.REFUSED, 1, payload=b"the run is over"))
    assert ended == [("the run is over", 0)]
    assert len(link.requests) == 2
