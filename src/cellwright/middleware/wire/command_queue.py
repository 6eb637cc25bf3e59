"""Commands of clients on their way to the cell, and steps that wait for them: what the bridges of ROS 1 and 2 share.

The cell carries out commands at its own pace. Of each topic some messages are with the cell, and the others wait here,
up to a limit; beyond it the oldest is dropped and counted.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from dataclasses import dataclass
from functools import partial
from typing import Callable, Mapping

from cellwright.middleware.wire.connection import LinkClient
from cellwright.middleware.wire.event_loop import EventLoop, ThrottledLog, nothing
from cellwright.middleware.wire.frames import SAID, Frame, FrameError, FrameKind, advance, read_time

COMMAND_QUEUE = 1000  # messages of a topic that may wait for the cell: each may command other joints
WINDOW = 16
"""Messages of a topic that the cell has not answered yet: on a busy machine each answer waits for both processes. It is
what the cell's server carries out of one client in a turn."""
MAX_COMMAND_BYTES = 64 << 20  # bytes of them, even if their number has no limit
MESSAGE_TIMEOUT = 5.0  # time for published messages to arrive [s]
FRESH = 0.05
"""Wall time [s] for which the cell's last answer counts as the current time; others may advance it too, so it is
requested again then. Callers that step at the same moment wait for the same time."""


def refusal_line(answer: Frame, name: str, sender: str = "") -> str:
    """Return the line about a refusal that the cell has reported; empty if it refused nothing, or only counted it.

    Args:
        answer: the cell's answer.
        name: topic, service or action, as its user named it.
        sender: node of the user; empty if unknown.
    """
    if answer.kind is not FrameKind.REFUSED or answer.type != SAID:
        return ""
    source = f"{name} from {sender}" if sender else name
    return f"refused {source}: {' '.join(answer.text().split())}{answer.node}"


class CommandQueue:
    """Messages of one topic for the cell; at most `limit` of them wait.

    In lockstep they are counted by sender, and `on_handed_over` is called after each message to the cell. `log` takes
    the lines about refused ones, without their senders if these `are_unknown`. `take` is for any thread.
    """

    def __init__(
        self,
        loop: EventLoop,
        link: LinkClient,
        name: str,
        type_name: str,
        *,
        limit: int | None = COMMAND_QUEUE,
        on_handed_over: Callable[[], None] | None = None,
        log: Callable[[str], None] = nothing,
        are_unknown: bool = False,
    ) -> None:
        self.name = name
        self._log = log
        self._are_unknown = are_unknown
        self._type = type_name
        self._link = link
        self._limit = limit
        self._on_handed_over = on_handed_over
        self._lock = threading.Lock()
        self._waiting: deque[tuple[str, object, bytes, str]] = deque()
        self._bytes = 0
        self._unanswered = 0
        self._counts: dict[str, tuple[object, int]] = {}
        self._drops = ThrottledLog(loop, "{count} messages on {subject} dropped: the cell is too slow")
        self._unfit = ThrottledLog(loop, "{count} messages on {subject} dropped: too long")

    def handed_over(self, sender: str) -> int:
        """Return the number of a node's messages to the cell since it connected; in lockstep."""
        with self._lock:
            _, count = self._counts.get(sender, (None, 0))
            return count

    def take(self, sender: str, data: bytes, connection: object = None, name: str = "") -> None:
        """Take a message of a node; its count starts again with another `connection`.

        `name` is that of the topic for the sender, if it is another one than for the cell.
        """
        with self._lock:
            dropped = 0
            while self._waiting and self._is_full(len(data)):
                oldest = self._waiting.popleft()
                self._bytes -= len(oldest[2])
                # In lockstep time must not wait for it.
                self._count(oldest[0], oldest[1])
                dropped += 1
            self._waiting.append((sender, connection, data, name))
            self._bytes += len(data)
            self._hand_over()
        self._drops.count(self.name, dropped)

    def _is_full(self, more: int) -> bool:
        """True if there is no room for a message of `more` bytes."""
        is_crowded = self._limit is not None and len(self._waiting) >= self._limit
        return is_crowded or self._bytes + more > MAX_COMMAND_BYTES

    def _hand_over(self) -> None:
        """Send the cell the messages that have waited longest; under the lock."""
        while self._waiting and self._unanswered < WINDOW:
            sender, connection, data, name = self._waiting.popleft()
            self._bytes -= len(data)
            try:
                answered = partial(self._answered, name or self.name, "" if self._are_unknown else sender)
                self._link.request(
                    FrameKind.PUBLISH, answered, name=self.name, type=self._type, node=sender, payload=data
                )
            except FrameError:
                self._count(sender, connection)
                self._unfit.count(self.name)
                continue
            self._unanswered += 1
            self._count(sender, connection)

    def _count(self, sender: str, connection: object) -> None:
        """Count a message of a node as handled; in lockstep."""
        if self._on_handed_over is not None:
            before, count = self._counts.get(sender, (connection, 0))
            self._counts[sender] = (connection, count + 1 if before is connection else 1)
            self._on_handed_over()

    def _answered(self, name: str, sender: str, answer: Frame) -> None:
        """Send the next message after an answer."""
        if line := refusal_line(answer, name, sender):
            self._log(line)
        with self._lock:
            self._unanswered -= 1
            self._hand_over()


@dataclass
class Step:
    """Requested step of time in lockstep."""

    caller: str  # its node
    duration: int  # [ns]
    published: Mapping[str, int]  # number of messages that the caller has published, by topic
    finished: Callable[[str, int], None]  # takes the reason of a failure, empty for none, and simulation time [ns]
    is_gone: Callable[[], bool] = lambda: False  # true if the caller waits no more
    end: float = 0.0  # wall time [s] at which the step fails for lack of messages
    until: int | None = None  # simulation time at its end [ns]; None before it has begun


class StepQueue:
    """Steps of time, carried out one after the other; each waits for its caller's messages. For the loop's thread.

    `topics` are those that the cell receives.
    """

    def __init__(self, loop: EventLoop, link: LinkClient, topics: Mapping[str, CommandQueue]) -> None:
        self._loop = loop
        self._link = link
        self._topics = topics
        self._steps: deque[Step] = deque()
        self._is_advancing = False
        self._now = 0
        self._known = -FRESH

    def add(self, step: Step) -> None:
        """Carry out a step after those that wait, or refuse it at once."""
        step.published = {name: count for name, count in step.published.items() if count}
        unknown = [name for name in step.published if name not in self._topics]
        if step.duration < 0:
            step.finished(f"duration must not be negative (got {step.duration / 1e9:g} s)", 0)
        elif unknown:
            step.finished(f"the cell does not subscribe to {unknown[0]} (known: {', '.join(self._topics)})", 0)
        else:
            self._steps.append(step)
            if len(self._steps) == 1:
                self._begin()

    def look(self) -> None:
        """Check whether the messages that the step waits for have come."""
        if not self._steps or self._is_advancing:
            return
        step = self._steps[0]
        missing = self._missing(step)
        if missing is None:
            self._is_advancing = True
            if time.monotonic() - self._known < FRESH:
                step.until = self._now + step.duration
            self._advance(step.until or 0)
        elif time.monotonic() > step.end:
            self._finish(missing)

    def _begin(self) -> None:
        self._steps[0].end = time.monotonic() + MESSAGE_TIMEOUT
        self.look()
        if self._steps and not self._is_advancing:
            self._loop.later(MESSAGE_TIMEOUT + 0.001, self.look)

    def _missing(self, step: Step) -> str | None:
        for name, count in step.published.items():
            arrived = self._topics[name].handed_over(step.caller)
            if arrived < count:
                sender = f" from {step.caller}" if step.caller else ""
                return f"only {arrived} of {count} messages on {name}{sender} arrived within {MESSAGE_TIMEOUT:g} s"
        return None

    def _advance(self, until: int) -> None:
        self._link.request(FrameKind.ADVANCE, self._advanced, payload=advance(0, until, each_tick=False).payload)

    def _advanced(self, frame: Frame) -> None:
        step = self._steps[0]
        try:
            if frame.kind is not FrameKind.TIME:
                raise FrameError(frame.text())
            self._now = now = read_time(frame)
            self._known = time.monotonic()
        except FrameError as error:
            self._finish(str(error))
            return
        if step.until is None:
            step.until = now + step.duration
        if now < step.until and not step.is_gone():
            self._advance(step.until)
        else:
            self._finish("", now)

    def _finish(self, failure: str, now: int = 0) -> None:
        step = self._steps.popleft()
        self._is_advancing = False
        step.finished(failure, now)
        if self._steps:
            self._begin()
