"""Serving a cell to other processes: a run whose time passes by the wall clock, or in lockstep when a guest asks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from cellwright.cell.cell import Cell
from cellwright.clients.agents.agent import Agent
from cellwright.engine.loop import Loop, Pace
from cellwright.engine.rate_control import RateControl
from cellwright.middleware.server import Server
from cellwright.running.run import (
    Outcome,
    RunContext,
    RunOptions,
    RunResult,
    execute_run,
    how_it_ended,
    work_in_process,
)
from cellwright.util.errors import RunEndedError, SimulationError, UsageError


@dataclass(frozen=True)
class Hooks:
    """What others do while a cell is served.

    Attributes:
        on_ready: called when guests are about to be served and time is about to pass.
        on_poll: called about ten times a second of wall time; it may end the serving with `Serving.stop`.
        on_over: called with what came of the run, while guests are still there.
    """

    on_ready: Callable[[], None] = lambda: None
    on_poll: Callable[[], None] = lambda: None
    on_over: Callable[[RunResult], None] = lambda _result: None


class Attendance:
    """Guests who look on while a cell is worked in this process.

    Args:
        cell: the cell.
        server: serves them between two ticks, and while time stands.
        tempo: how time is to pass.
    """

    def __init__(self, cell: Cell, server: Server, tempo: RateControl) -> None:
        self._loop = Loop(cell.simulation, server, rate=tempo)

    def stop(self) -> None:
        """Let the run end before the next tick."""
        self._loop.stop.request()

    def work(self, agent: Agent | None, course: RunContext) -> tuple[Outcome, str]:
        """Let an agent work, as `work_in_process` does; without one, let time pass."""
        course.transport.step = self._step
        return work_in_process(agent, course)

    def _step(self) -> None:
        if not self._loop.tick():
            raise RunEndedError("somebody who looks on has ended the run")


@dataclass
class Serving:
    """A cell that is served until its time is over or somebody stops it.

    Args:
        cell: what is served.
        server: where.
        tempo: how time is to pass: a `Tempo`, or a speed that stays, in simulated seconds a wall second; None: as fast
            as it goes.
        hooks: what others do meanwhile.
        patience: in lockstep, how long [s] of wall time to go on serving when there is no more time to be had: who
            asks for some is told so, and may still ask for other things.
    """

    cell: Cell
    server: Server
    tempo: float | RateControl | None = 1.0
    hooks: Hooks = field(default_factory=Hooks)
    patience: float = 0.0
    pace: Pace | None = None
    """How time kept to the wall clock, when all is over; None where it did not have to."""

    def __post_init__(self) -> None:
        self._stopped = False
        self._loop: Loop | None = None
        self._course: RunContext | None = None

    def stop(self) -> None:
        """Let the serving end before the next tick; to be called from anywhere, a signal's handler included."""
        self._stopped = True
        if self._loop is not None:
            self._loop.stop.request()

    def begin_anew(self) -> None:
        """Begin the run anew, at time 0; guests stay.

        Raises:
            UsageError: it has not begun.
        """
        if self._course is None:
            raise UsageError("the run has not begun")
        self._course.begin_anew()

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
            result = execute_run(self.cell, self.work, options)
            reason = f"the run is over: {result.outcome}"
            self.hooks.on_over(result)
            return result
        finally:
            self.server.close(reason)

    def work(self, course: RunContext) -> tuple[Outcome, str]:
        """Let time pass; how that ended, and what went wrong. The server is left open."""
        self._course, transport = course, course.transport
        self.hooks.on_ready()
        loop = self._loop = Loop(
            self.cell.simulation,
            self.server,
            rate=self.tempo,
            stop=transport.stop,
            on_poll=self.hooks.on_poll,
            patience=self.patience,
        )
        if self._stopped:
            loop.stop.request()
        try:
            loop.run()
        except SimulationError as error:
            return Outcome.UNSTABLE, f"{error}\n"
        self.pace = loop.pace
        return how_it_ended(self.cell, otherwise=Outcome.UNTIL), ""
