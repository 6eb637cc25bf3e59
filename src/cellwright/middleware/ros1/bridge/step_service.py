"""Time in lockstep, as a service: `/cellwright/step` lets a duration pass, and nothing else does.

A caller may say how many messages it has published on which topics; then the step waits for them, since they come by
other connections and might be overtaken. The answer says how many messages the caller has been sent on each topic that
it subscribes to, so that it can wait for them in turn: the same program gets the same result on any host.
"""

from __future__ import annotations

import struct
import time
from collections import deque
from dataclasses import dataclass

from cellwright.middleware.ros1.bridge.link_client import LinkClient
from cellwright.middleware.ros1.bridge.loop import Loop
from cellwright.middleware.ros1.bridge.sent import Sent
from cellwright.middleware.ros1.bridge.services import Caller
from cellwright.middleware.ros1.bridge.step_bytes import TYPE, read_request, response
from cellwright.middleware.ros1.bridge.subscriptions import CommandTopic
from cellwright.middleware.wire.frames import Frame, FrameError, Kind, advance, read_time

NAME = "/cellwright/step"

PATIENCE = 5.0
"""How long published messages may take to come [s]."""

FRESH = 0.05
"""How long [s] of wall time the last answer of the cell tells the time, after which it is asked again: there may be
others that let time pass. Those that do so at the same moment wait for the same time."""

_NANOSECONDS = 1_000_000_000


@dataclass
class Step:
    """A step that somebody has asked for.

    Attributes:
        caller: who asks, and is answered.
        duration: how long it is to be [ns].
        published: how many messages the caller has published, by topic.
        end: when the step fails for lack of messages; wall time [s].
        until: simulation time at its end [ns]; None before it has begun.
    """

    caller: Caller
    duration: int
    published: dict[str, int]
    end: float = 0.0
    until: int | None = None


class StepService:
    """Carries out steps, one after the other.

    Args:
        loop: calls back.
        link: the way to the cell.
        topics: the topics that the cell hears, by name.
        sent: counts what callers have been sent.
    """

    def __init__(self, loop: Loop, link: LinkClient, topics: dict[str, CommandTopic], sent: Sent) -> None:
        self._loop = loop
        self._link = link
        self._topics = topics
        self._sent = sent
        self._steps: deque[Step] = deque()
        self._is_advancing = False
        self._now = 0
        self._known = -FRESH

    def handle(self, caller: Caller, request: bytes) -> None:
        """Take a request."""
        try:
            duration, published = read_request(request)
        except (struct.error, ValueError) as error:
            caller.respond(False, f"this is no request of {TYPE}: {error}".encode())
            return
        published = {name: count for name, count in published.items() if count}
        unknown = [name for name in published if name not in self._topics]
        if duration < 0:
            caller.respond(True, response(f"time does not go back: {duration / _NANOSECONDS:g} s", 0, []))
        elif unknown:
            caller.respond(True, response(f"the cell hears no {unknown[0]}; it hears {', '.join(self._topics)}", 0, []))
        else:
            self._steps.append(Step(caller, duration, published))
            if len(self._steps) == 1:
                self._begin()

    def look(self) -> None:
        """See whether the messages have come that the step waits for. Called by the loop's thread."""
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
        self._steps[0].end = time.monotonic() + PATIENCE
        self.look()
        if self._steps and not self._is_advancing:
            self._loop.later(PATIENCE + 0.001, self.look)

    def _missing(self, step: Step) -> str | None:
        for name, count in step.published.items():
            come = self._topics[name].handed_over(step.caller.node)
            if come < count:
                return f"only {come} of {count} messages on {name} have come from {step.caller.node} in {PATIENCE:g} s"
        return None

    def _advance(self, until: int) -> None:
        self._link.request(Kind.ADVANCE, self._advanced, payload=advance(0, until, each_tick=False).payload)

    def _advanced(self, frame: Frame) -> None:
        step = self._steps[0]
        try:
            if frame.kind is not Kind.TIME:
                raise FrameError(frame.text())
            self._now = now = read_time(frame)
            self._known = time.monotonic()
        except FrameError as error:
            self._finish(str(error))
            return
        if step.until is None:
            step.until = now + step.duration
        if now < step.until and not step.caller.is_gone:
            self._advance(step.until)
        else:
            self._finish("", now)

    def _finish(self, message: str, now: int = 0) -> None:
        step = self._steps.popleft()
        self._is_advancing = False
        step.caller.respond(True, response(message, now, self._sent.of(step.caller.node)))
        if self._steps:
            self._begin()
