"""Schedule of a policy: when it is asked, and which action of which answer acts in each control period.

Everything is in ticks of the simulation from the begin of the episode; there is no cell and no clock here. A control
instant is a whole number of periods. A request carries the observation of an instant. Its answer exists `latency` ticks
later, and acts from the first instant after that. So a fixed latency gives the same run on any machine.

Real-time chunking (arXiv 2506.07339) has the same rule with a delay in whole control steps; here it is in ticks.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from cellwright.util.errors import UsageError


class Mode(StrEnum):
    """Ways in which robot and world go on while the policy thinks."""

    ASYNC = "async"
    """The former answer goes on while it lasts; then the robot holds."""
    SYNC = "sync"
    """The robot holds, and the world goes on."""
    FROZEN = "frozen"
    """The world stands still; so no answer has a latency."""


class Chosen(NamedTuple):
    """An action: the number of its request, and its place in the answer."""

    request: int
    place: int


@dataclass
class Request:
    """A request, by ticks from the begin of the episode.

    Attributes:
        number: its number, from 0.
        observed: tick of the observation.
        latency: ticks until the answer exists.
        first: the first instant at which the answer can act.
        index: index of its first action to act.
        length: number of actions in the answer.
        used: number of them that have acted so far.
        held: ticks in which there was no action to act after this answer's.
    """

    number: int
    observed: int
    latency: int
    first: int
    index: int
    length: int
    used: int = 0
    held: int = 0

    @property
    def dropped(self) -> int:
        """Number of actions that have not acted so far."""
        return self.length - self.used


class Schedule:
    """The schedule of one episode.

    At each control instant, in order: ask `is_due`; if so, ask the policy and call `ask`; then act on `choose`.

    Args:
        period: ticks between two control instants.
        mode: rule for the time in which the policy thinks.
        horizon: number of actions after which the next request is made; None: all of an answer, in `async` half of it.
        drops_stale: True if actions for instants that are past when the answer comes are left out, so that each acts
            at the time it was made for; None: in `async` alone. The others play each answer from its first action.
        thinks_first: True if the world stands still for the first request.

    Raises:
        UsageError: a number is not above 0.

    Example:
        >>> schedule = Schedule(25, mode=Mode.ASYNC, horizon=4)
        >>> acted = []
        >>> for instant in range(0, 300, 25):
        ...     if schedule.is_due(instant):
        ...         _ = schedule.ask(instant, latency=30, length=8)
        ...     acted.append(schedule.choose(instant))
        >>> [None if each is None else each.place for each in acted]
        [None, None, 2, 3, 4, 5, 2, 3, 4, 5, 2, 3]
    """

    def __init__(
        self,
        period: int,
        *,
        mode: Mode,
        horizon: int | None = None,
        drops_stale: bool | None = None,
        thinks_first: bool = False,
    ) -> None:
        if period < 1 or (horizon is not None and horizon < 1):
            raise UsageError(f"period and horizon must be at least 1 (got {period}, {horizon})")
        self.period, self.mode = period, mode
        self._horizon = horizon
        self._drops_stale = mode is Mode.ASYNC if drops_stale is None else drops_stale
        self._thinks_first = thinks_first
        self.requests = 0
        """Number of requests so far."""
        self.acting: Request | None = None
        """Request whose answer acts; None before the first."""
        self.coming: Request | None = None
        """Request whose answer does not exist yet; None if there is none."""
        self.waited = 0
        """Ticks before the first answer."""

    def is_due(self, instant: int) -> bool:
        """Return whether a request is to be made with the observation of this instant."""
        self._settle(instant)
        if self.coming is not None:
            return False
        if self.acting is None:
            return True
        if self.mode is Mode.ASYNC:
            return instant >= self.acting.observed + self._part(self.acting) * self.period
        return self._index(self.acting, instant) >= self._end(self.acting)

    def ask(self, instant: int, *, latency: int, length: int) -> Request:
        """Take note of a request with the observation of this instant, and of the answer's latency and length.

        Raises:
            UsageError: a request is under way already, or a number is negative.
        """
        if self.coming is not None or latency < 0 or length < 1:
            raise UsageError(
                f"a request must be due, its latency not negative, and its answer not empty (got {latency}, {length})"
            )
        stands = self.mode is Mode.FROZEN or (self._thinks_first and self.requests == 0)
        ready = instant if stands else instant + latency
        first = -(-ready // self.period) * self.period
        index = (first - instant) // self.period if self._drops_stale else 0
        self.coming = Request(self.requests, instant, 0 if stands else latency, first, index, length)
        self.requests += 1
        request = self.coming
        self._settle(instant)
        return request

    def choose(self, instant: int) -> Chosen | None:
        """Return the action that acts from this instant on; None: the robot holds."""
        self._settle(instant)
        if self.acting is None:
            self.waited += self.period
            return None
        index = self._index(self.acting, instant)
        if index >= self._end(self.acting):
            self.acting.held += self.period
            return None
        self.acting.used += 1
        return Chosen(self.acting.number, index)

    def _settle(self, instant: int) -> None:
        if self.coming is not None and instant >= self.coming.first:
            self.acting, self.coming = self.coming, None

    def _index(self, request: Request, instant: int) -> int:
        return request.index + (instant - request.first) // self.period

    def _part(self, request: Request) -> int:
        """Return the number of actions after which the next request is made."""
        default = max(1, request.length // 2) if self.mode is Mode.ASYNC else request.length
        return min(self._horizon or default, request.length)

    def _end(self, request: Request) -> int:
        """Return the index at which an answer ends."""
        if self.mode is Mode.ASYNC:
            return request.length  # it goes on until the next one comes
        return min(request.index + self._part(request), request.length)
