"""One run of a session, under way or over: its limits, its figures and its files."""

from __future__ import annotations

import time
from contextlib import ExitStack

from cellwright.engine.clock import NEVER, nanoseconds
from cellwright.engine.loop import SimulationLoop, StopCondition
from cellwright.running.run.files import RunFiles
from cellwright.running.run.options import Outputs, RunOptions
from cellwright.running.run.result import Outcome, SessionResult
from cellwright.running.run.target import Ending, Player, Prepared, Refereed, Target, subscribe
from cellwright.util.errors import SimulationError

_ONE_COURSE = "a recording, video or log of this run is being written, and has one course of time; run without them"


class RunState:
    """State of one run of a session.

    Args:
        target: the open target.
        loop: steps its simulation.
        files: files of the run.
        until: stop at this simulation time [s], if nothing else comes before.
        has_agent: an agent of this process works it.

    Attributes:
        is_over: True once it has a result.
    """

    def __init__(
        self, target: Target, loop: SimulationLoop, files: RunFiles, *, until: float | None, has_agent: bool
    ) -> None:
        self.loop, self.has_agent, self.is_over = loop, has_agent, False
        self._target, self._files, self._until = target, files, until
        self._referee = target if isinstance(target, Refereed) else None
        self._simulation = target.node.simulation
        self._first_tick, self._begun = 0, 0.0

    @property
    def stop(self) -> StopCondition:
        """Stop condition of the run."""
        return self.loop.stop

    def begin(self, options: RunOptions, outputs: Outputs, run: ExitStack, *, waits: bool) -> None:
        """Start the run, and open its files until `run` is left; simulation time `waits` for a video or does not."""
        simulation = self._simulation
        self._limit_time()
        if isinstance(self._target, Prepared):
            self._target.begin(options, run)
        self._first_tick = simulation.clock.tick
        subscribe(simulation.on_rewind, lambda _time: self._limit_time(), run)
        if self._files.options.has_files:
            subscribe(simulation.rewind_refusals, lambda: _ONE_COURSE, run)
        latest_end = min(self.stop.deadline, NEVER if self._referee is None else self._referee.latest_end())
        self._files.open(run, waits=waits, latest_end=None if latest_end == NEVER else latest_end, notice=outputs.note)

    def begin_time(self) -> None:
        """Note that time is about to pass."""
        self.loop.pacer.begin()
        self._begun = time.perf_counter()

    def restarted(self, before: int) -> None:
        """Count from time 0 again, since the simulation was reset under way at the time `before` [ns]."""
        self._first_tick = 0
        self._limit_time()
        self._files.reset(before)

    def _limit_time(self) -> None:
        """Let the run end at the limits of the session, and at its own."""
        self.stop.reset()
        if self._until is not None:
            self.stop.limit(nanoseconds(self._until))

    def pass_time(self) -> tuple[str, str]:
        """Let time pass until the run stops; return how it ended, and the error."""
        referee = self._referee
        try:
            if isinstance(self._target, Player):
                self._target.play(self.loop)
            else:
                self.loop.run()
        except SimulationError as error:
            return ("unstable", str(error)) if referee is None else (Outcome.UNSTABLE, f"{error}\n")
        except KeyboardInterrupt:
            return "stopped" if referee is None else Outcome.INTERRUPTED, ""
        return self.outcome_by_now() if referee or self.stop.is_requested else "until", ""

    def outcome_by_now(self) -> str:
        """Return the outcome of the run if it is stopped now."""
        return "stopped" if self._referee is None else self._referee.outcome_by_now()

    def result(self, outcome: str, error: str = "") -> SessionResult:
        """Return the result of the run so far."""
        simulation = self._simulation
        measured = SessionResult(
            outcome=outcome,
            error=error,
            simulated=simulation.time - self._first_tick * float(simulation.clock.timestep),
            wall=time.perf_counter() - self._begun,
            steps=simulation.clock.tick - self._first_tick,
            state_hash=simulation.state_hash(),
            pace=self.loop.pace,
        )
        return measured if self._referee is None else self._referee.judged(measured)

    def end(self, outcome: str, error: str, *, restarts: bool) -> SessionResult:
        """End the run; return its result, to which the files add when they are closed."""
        result = self.result(outcome, error)
        self.is_over = True
        if isinstance(self._target, Ending):
            result = self._target.end(result, restarts=restarts)
        self._files.result = result
        return result
