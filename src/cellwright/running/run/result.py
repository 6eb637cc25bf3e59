"""Result of a run: its outcome and its score."""

import platform
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from cellwright._package import VERSION
from cellwright.cell.cell import Cell
from cellwright.cell.kitting.evidence import Evidence
from cellwright.cell.kitting.scorer import GameScore
from cellwright.engine.loop import PaceFigures
from cellwright.running.run.collisions import Approach, Collision


class Outcome(StrEnum):
    """Outcome of a run.

    Example:
        >>> import cellwright
        >>> result = cellwright.run_trial("lesson", None, options=cellwright.RunOptions(until=0.1))
        >>> result.outcome is cellwright.Outcome.UNTIL
        True
        >>> print(result.outcome)
        stopped before the competition was done
    """

    DONE = "done"
    TASK_FAILED = "the competition was done before the task had succeeded"
    NO_ORDER = "the trial has no order"
    TIME_LIMIT = "time limit"
    GAVE_UP = "the agent ended before the orders were complete"
    CRASHED = "the agent crashed"
    INFRASTRUCTURE = "the policy could not be asked"
    UNSTABLE = "the simulation became unstable"
    UNTIL = "stopped before the competition was done"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True, kw_only=True)
class SessionResult:
    """Result of a session's run. Times in seconds.

    Example:
        >>> import cellwright
        >>> result = cellwright.Session("tandem").run(until=0.1)
        >>> result.outcome, result.simulated
        ('until', 0.1)

    Attributes:
        outcome: its end: an `Outcome` for a cell; else `stopped`, `until` (its time was over), `unstable`, or
            `infrastructure` (its policy could not be asked).
        error: the error in words; empty if there was none.
        simulated: simulation time that passed.
        wall: wall time that passed.
        steps: number of steps.
        state_hash: state hash at the end.
        pace: pace of simulation time against the wall clock; None if it did not have to.
        recordings: the recordings written.
        videos: the videos written: `file`, `length` [s], `frames` and `dropped` of each.
        is_recorded: True if the recordings hold everything that they should.
        is_complete: True if every requested file is whole.
    """

    outcome: str
    error: str = ""
    simulated: float
    wall: float
    steps: int
    state_hash: str
    pace: PaceFigures | None = None
    recordings: tuple[Path, ...] = ()
    videos: tuple[dict[str, float | str], ...] = ()
    is_recorded: bool = True
    is_complete: bool = True

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds a wall second."""
        return self.simulated / self.wall if self.wall > 0 else 0.0

    def recorded(self) -> dict[str, Any]:
        """Return the result for a recording."""
        return {"outcome": self.outcome, "error": self.error, "wall": self.wall}


@dataclass(frozen=True, kw_only=True)
class RunResult(SessionResult):
    """Result of a run of a cell: that of any session, and the referee's.

    Example:
        >>> import cellwright
        >>> result = cellwright.run_trial("lesson", None, options=cellwright.RunOptions(until=0.1))
        >>> print(result.competition_state, result.score.total, result.steps)
        init 0 50

    Attributes:
        competition_state: the last one.
        score: points and times.
        evidence: the score with the facts that it follows from.
        heard: number of messages of each topic that was listened to.
        collisions: collisions of the links of arms and robots.
        nearest_arms: smallest distance between two arms or robots; None with one of them.
        success: True if the task has succeeded; None in a trial without a task.
        succeeded_at: simulation time of its first success [s]; None without one.
    """

    outcome: Outcome
    competition_state: str
    score: GameScore
    evidence: Evidence
    heard: Mapping[str, int] = field(default_factory=dict)
    collisions: tuple[Collision, ...] = ()
    nearest_arms: Approach | None = None
    success: bool | None = None
    succeeded_at: float | None = None

    @property
    def word(self) -> str:
        """Word for how the run ended, in logs, recordings and JSON."""
        return self.outcome.name.lower()

    def recorded(self) -> dict[str, Any]:
        """Return the result for a recording."""
        facts = {"outcome": self.word, "score": self.score.total, "wall": self.wall}
        return facts | self.facts("competition_state", "state_hash", "error", "simulated", "steps", *self.of_task)

    @property
    def points(self) -> float:
        """Points in an evaluation: those of the score; a task is worth one, if it has succeeded."""
        return self.score.total if self.success is None else float(self.success)

    @property
    def of_task(self) -> tuple[str, ...]:
        """Names of the attributes on the task; none in a trial without one."""
        return () if self.success is None else ("success", "succeeded_at")

    def facts(self, *names: str) -> dict[str, Any]:
        """Return the attributes of these names."""
        return {name: getattr(self, name) for name in names}


def cell_result(result: SessionResult | None) -> RunResult:
    """Return the result of a run of a cell."""
    assert isinstance(result, RunResult)
    return result


def final_outcome(cell: Cell, *, otherwise: Outcome) -> Outcome:
    """Return the outcome of a run that came to its end: that of its task or of the competition, or `otherwise`.

    A competition without an order ends at once, and shows nothing, unless there is a task.
    """
    if cell.task is not None and cell.task.succeeded_at is not None:
        return Outcome.DONE
    if cell.competition.state != "done":
        return otherwise
    if not cell.trial.orders and cell.task is None:
        return Outcome.NO_ORDER
    if cell.competition.is_timed_out:
        return Outcome.TIME_LIMIT
    return Outcome.DONE if cell.task is None else Outcome.TASK_FAILED


def versions() -> dict[str, str]:
    """Return the versions that a result depends on, besides trial, agent and seed."""
    return {
        "cellwright": VERSION,
        "mujoco": mujoco.__version__,
        "numpy": np.__version__,
        "python": platform.python_version(),
        "platform": f"{platform.system()} {platform.machine()}",
    }
