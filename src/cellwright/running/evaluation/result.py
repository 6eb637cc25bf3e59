"""What came of one job, as it lies on disk."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from enum import StrEnum
from typing import Any

from cellwright.running.evaluation.job import Job
from cellwright.running.evaluation.limits import Limits
from cellwright.running.evaluation.result_form import RESULT, find_misfit
from cellwright.running.run import Outcome
from cellwright.util.errors import CellwrightError

OUTCOMES = {outcome.name.lower(): str(outcome) for outcome in Outcome}
"""How a run can end, in the words of files and of people."""


class Lost(StrEnum):
    """How a run can be lost."""

    WALL_LIMIT = "wall_limit"
    """It was still at work when its time on the wall clock was over."""
    MEMORY_LIMIT = "memory_limit"
    """It wanted more memory than it was allowed."""
    LOG_LIMIT = "log_limit"
    """It wrote more than its log may hold."""
    DIED = "died"
    """Its process ended by itself."""


class ResultError(CellwrightError):
    """Text that should have been a result and is not."""


@dataclass(frozen=True, slots=True)
class Result:
    """What came of a job.

    Attributes:
        key: the job's key.
        trial: name of the trial.
        agent: who worked it.
        seed: its seed.
        vary: whether the cell was varied.
        outcome: a name of `Outcome` in small letters, or a value of `Lost`.
        points: what it earned; 0 when its process could not say so any more.
        reachable: the most points that anybody can earn in the trial.
        best: what its orders would earn if nothing were out of reach.
        wall: time it took on the wall clock [s].
        simulated: simulation time that passed [s].
        reason: why it was not done, in a line; empty when it was.
        limits: what it was allowed to use.
        state_hash: SHA-256 of the whole last state.
        score: the score with its evidence.
        timeline: what happened when.
        log: the last lines of its log, when it was not done.
        command: the command that does the same run alone.
    """

    key: str
    trial: str
    agent: str
    seed: int
    vary: bool
    outcome: str
    points: float
    reachable: float
    best: float
    wall: float
    simulated: float = 0.0
    reason: str = ""
    limits: dict[str, float] = field(default_factory=dict)
    state_hash: str = ""
    score: dict[str, Any] = field(default_factory=dict)
    timeline: dict[str, Any] = field(default_factory=dict)
    log: tuple[str, ...] = ()
    command: str = ""

    @property
    def name(self) -> str:
        """What people call it."""
        return f"{self.trial} seed {self.seed}"

    @property
    def is_done(self) -> bool:
        """Whether the competition was brought to its end."""
        return self.outcome == Outcome.DONE.name.lower()

    @property
    def is_lost(self) -> bool:
        """Whether the run was ended, or ended, before it was over."""
        return self.outcome in tuple(Lost)

    @property
    def share(self) -> float:
        """The share of the points within reach; 1 for a trial that has none."""
        return self.points / self.reachable if self.reachable > 0 else 1.0

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds a wall second."""
        return self.simulated / self.wall if self.wall > 0 else 0.0

    @property
    def ending(self) -> str:
        """How it ended, in words."""
        return OUTCOMES.get(self.outcome, "lost: " + self.outcome.replace("_", " "))

    def as_json(self) -> dict[str, Any]:
        """As JSON values."""
        return asdict(self)

    @classmethod
    def from_json(cls, document: Any) -> Result:
        """Read what `as_json` made.

        Raises:
            ResultError: it is something else.
        """
        names = {each.name for each in fields(cls)}
        if not isinstance(document, Mapping) or set(document) != names:
            raise ResultError("not a result of this version of Cellwright")
        if misfit := find_misfit(document, RESULT):
            raise ResultError(f"not a result of this version of Cellwright: {misfit}")
        return cls(**{**document, "log": tuple(document["log"])})


def lost(job: Job, kind: Lost, reason: str, limits: Limits, *, wall: float, simulated: float) -> Result:
    """The result of a job whose run told none, after so much wall and simulation time [s]."""
    return Result(
        key=job.key,
        trial=job.trial.name,
        agent=job.agent,
        seed=job.seed,
        vary=job.vary,
        outcome=kind.value,
        points=0.0,
        reachable=job.trial.reachable,
        best=job.trial.best,
        wall=wall,
        simulated=simulated,
        reason=reason,
        limits=asdict(limits),
        command=job.command,
    )
