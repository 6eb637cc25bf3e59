"""Serving a cell to other processes: time passes by the wall clock, or in lockstep when a guest asks for it.

In lockstep a guest that asks is given time up to the moment that it names, or to the tick in which it is told
something. With several guests each may ask; their wishes are met one after another, in the order in which they came.
A wish names a moment, not a duration: two guests that wait for the same moment make time pass once.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from cellwright.cell import Cell
from cellwright.client.transports.in_process import InProcess
from cellwright.errors import RunEndedError, SimulationError, UsageError
from cellwright.run import Course, Outcome, RunOptions, RunResult, conduct, how_it_ended
from cellwright.server import Server
from cellwright.server.requests import Asked
from cellwright.simulation.pacing import Pacer

_POLL = 0.1  # [s] of wall time
_SERVE_AFTER = 0.001  # [s] of wall time: so often guests are served even when there is no time to wait


@dataclass(frozen=True)
class Hooks:
    """What others do while a cell is served.

    Attributes:
        on_ready: called when guests are about to be served and time is about to pass.
        on_poll: called about ten times a second of wall time; it may end the serving with `Serving.stop`.
    """

    on_ready: Callable[[], None] = lambda: None
    on_poll: Callable[[], None] = lambda: None


@dataclass(frozen=True)
class Pace:
    """How time kept to the wall clock.

    Attributes:
        factor: simulated seconds a wall second, on average.
        worst_lateness: how late [s] of wall time the latest tick came.
    """

    factor: float
    worst_lateness: float


@dataclass
class Serving:
    """A cell that is served until its time is over or somebody stops it.

    Args:
        cell: what is served.
        server: where.
        speed: simulated seconds a wall second; None: as fast as it goes.
        hooks: what others do meanwhile.
        patience: in lockstep, how long [s] of wall time to go on serving when there is no more time to be had: who
            asks for some is told so, and may still ask for other things.
    """

    cell: Cell
    server: Server
    speed: float | None = 1.0
    hooks: Hooks = field(default_factory=Hooks)
    patience: float = 0.0
    pace: Pace | None = None
    """How time kept to the wall clock, when all is over; None where it did not have to."""

    def __post_init__(self) -> None:
        self._stopped = False
        self._polled = self._served = 0.0
        self._course: Course | None = None

    def stop(self) -> None:
        """Let the serving end before the next tick; to be called from anywhere, a signal's handler included."""
        self._stopped = True

    def result_by_now(self) -> RunResult:
        """What has come of the run so far.

        Raises:
            UsageError: it has not begun.
        """
        if self._course is None:
            raise UsageError("the run has not begun")
        return self._course.result(how_it_ended(self.cell, otherwise=Outcome.UNTIL))

    def run(self, options: RunOptions) -> RunResult:
        """Serve from the start until `options` say that it is over, or until `stop`.

        Raises:
            UnknownNameError: a topic to listen to that does not exist.
            CheckpointError: the checkpoint to begin from cannot be read, or is of another cell.
        """
        reason = "the cell has stopped"
        try:
            result = conduct(self.cell, self.work, options)
            reason = f"the run is over: {result.outcome}"
            return result
        finally:
            self.server.close(reason)

    def work(self, course: Course) -> tuple[Outcome, str]:
        """Let time pass; how that ended, and what went wrong. The server is left open."""
        self._course, transport = course, course.transport
        self.hooks.on_ready()
        pacer = None if self.speed is None else Pacer(self.cell.simulation, self.speed, sleep=self._serve)
        step = self.cell.simulation.step if pacer is None else pacer.step
        try:
            if self.server.lockstep:
                self._pass_time_on_request(step, transport)
            else:
                self._pass_time(step, transport)
        except SimulationError as error:
            return Outcome.UNSTABLE, f"{error}\n"
        if pacer is not None and not self.server.lockstep:
            self.pace = Pace(pacer.factor, pacer.worst)
        return how_it_ended(self.cell, otherwise=Outcome.UNTIL), ""

    def _pass_time(self, step: Callable[[], object], transport: InProcess) -> None:
        clock = self.cell.simulation.clock
        while not self._stopped and clock.now < transport.deadline:
            step()
            self._look_around()

    def _pass_time_on_request(self, step: Callable[[], object], transport: InProcess) -> None:
        clock, end = self.cell.simulation.clock, float("inf")
        while not self._stopped and time.perf_counter() < end:
            is_over = clock.now >= transport.deadline
            if is_over and end == float("inf"):
                end = time.perf_counter() + self.patience
                continue
            asked = self.server.asked
            if asked is None:
                self._serve(_POLL / 2)
            elif is_over and asked.until > clock.now:
                self.server.answer(asked, RunEndedError(transport.reason))
            else:
                self._grant(asked, step, transport)
            self._look_around()

    def _grant(self, asked: Asked, step: Callable[[], object], transport: InProcess) -> None:
        """Let time pass as a guest asked for; not at all if it is gone."""
        clock = self.cell.simulation.clock
        while clock.now < asked.until and clock.now < transport.deadline:
            while self.server.is_anybody_behind and not self._stopped:
                self._serve(_POLL / 2)  # nothing is lost in lockstep: who is behind has to read first
            if asked.guest.is_gone or self._stopped:
                return
            step()
            if asked.each_tick or asked.guest.has_news:
                break
            self._look_around()
        self.server.answer(asked)

    def _look_around(self) -> None:
        """Serve and poll, where that was not done a moment ago."""
        now = time.perf_counter()
        if now - self._served > _SERVE_AFTER:
            self._serve(0.0)
        if now - self._polled > _POLL:
            self._polled = now
            self.hooks.on_poll()

    def _serve(self, seconds: float) -> None:
        self.server.wait(seconds)
        self._served = time.perf_counter()
