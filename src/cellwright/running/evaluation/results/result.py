"""Result of a run: its fields, the form of its JSON, and what no run can have."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from enum import StrEnum
from typing import Any

from cellwright.running.evaluation.plan.job import Job, RunLimits, log_name
from cellwright.running.evaluation.results.form import Each, Maybe, find_misfit
from cellwright.running.evaluation.results.seal import SealError, sealed, unsealed
from cellwright.running.run import Outcome
from cellwright.util.errors import CellwrightError

_MAX_LEVELS = 16  # of a result's lists and objects; it has 8
OUTCOMES = {outcome.name.lower(): str(outcome) for outcome in Outcome}
"""Outcomes of a run, by their words in files; the values are for people."""
POINT_TOLERANCE = 1e-6
"""Rounding that sums of points may have."""


_PART = {
    "type": str,
    "sentence": str,
    **dict.fromkeys(("presence", "pose", "reachable_presence", "reachable_pose"), float),
    **dict.fromkeys(("distance", "yaw_difference"), Maybe(float)),
}
_KIT = {
    "kit_type": str,
    "submitted": bool,
    "bonus_reason": str,
    **dict.fromkeys(("total", "reachable", "best", "part_presence", "all_parts_bonus", "part_pose"), float),
    "parts": [_PART],
    "extras": [{"name": str, "reason": str}],
}
_SPAN = {"begin": float, "end": Maybe(float)}
_TIMELINE = {
    "end": float,
    "orders": [{"order": str, "announced": float, "completed": Maybe(float)}],
    "kits": [{"time": float, "agv": str, "kit": str, "points": float}],
    "held": [{**_SPAN, "part": str}],
    "agvs": Each([{**_SPAN, "state": str}]),
}
RESULT_FORM: Mapping[str, Any] = {
    **dict.fromkeys(("key", "trial", "agent", "outcome", "reason", "state_hash", "command"), str),
    **dict.fromkeys(("points", "reachable", "best", "wall", "simulated"), float),
    "seed": int,
    "vary": bool,
    "limits": Each(float),
    "overrides": Each(str),
    "score": Maybe({"orders": [{"order_id": str, "kits": [_KIT]}]}),
    "timeline": Maybe(_TIMELINE),
    "log": [str],
    "over": str,
    "verified": bool,
    "steps": int,
    "success": Maybe(bool),
}
"""Form of a result."""


class Lost(StrEnum):
    """Ways to lose a run."""

    WALL_LIMIT = "wall_limit"
    """Its wall time was over while it still worked."""
    MEMORY_LIMIT = "memory_limit"
    """It requested more memory than its limit."""
    LOG_LIMIT = "log_limit"
    """It wrote more to its log than its limit."""
    START_LIMIT = "start_limit"
    """It let simulation time pass without starting the competition, more than its limit."""
    REFUSED = "refused"
    """The program could not be made, such as by an error in its import."""
    NOT_RUN = "not_run"
    """It was not run: earlier runs of the program were lost in a way that it would share."""
    DIED = "died"
    """Its process ended without a result."""
    INVALID = "invalid"
    """Its process sent something that no worker sends."""
    NOT_REPRODUCED = "not_reproduced"
    """Its commands alone did not give its result."""


class ResultError(CellwrightError):
    """A text is no result."""


@dataclass(frozen=True, slots=True)
class Result:
    """Result of a job.

    Attributes:
        outcome: a name of `Outcome` in small letters, or a value of `Lost`.
        points: points that it earned; 0 if its process could not report them.
        reachable: the most points that an agent can earn in the trial.
        best: points of its orders if all of them could be reached.
        wall: wall time that it took [s].
        simulated: simulation time that passed [s].
        reason: reason that it was not done, in one line; empty if it was.
        state_hash: SHA-256 of the whole last state.
        log: the last lines of its log, if it was not done.
        command: the command that repeats the run alone.
        overrides: values that replaced those of the trial's files, as YAML texts by key.
        over: `socket` if the program ran in a process of its own; empty if it ran in the referee's.
        verified: True if its commands gave the same result in a process without the program.
        steps: number of steps of the simulation.
        success: True if the task has succeeded; None in a trial without one, or if its process could not report it.
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
    overrides: dict[str, str] = field(default_factory=dict)
    over: str = ""
    verified: bool = False
    steps: int = 0
    success: bool | None = None

    @classmethod
    def of(cls, job: Job, limits: RunLimits, **content: Any) -> Result:
        """Return the result of a job within these limits; `content` holds the remaining fields."""
        return cls(
            key=job.key,
            trial=job.trial.name,
            agent=job.agent,
            seed=job.seed,
            vary=job.vary,
            reachable=job.trial.reachable,
            best=job.trial.best,
            limits=asdict(limits),
            command=job.command,
            overrides=job.overrides,
            over=job.over,
            **content,
        )

    @property
    def name(self) -> str:
        """Name of the run for people."""
        return f"{self.trial} seed {self.seed}"

    @property
    def log_name(self) -> str:
        """Name of the file for its output, as of its job."""
        return log_name(self.trial, self.seed, self.key)

    @property
    def is_done(self) -> bool:
        """True if the competition came to its end."""
        return self.outcome == Outcome.DONE.name.lower()

    @property
    def is_lost(self) -> bool:
        """True if the run was ended, or ended, before it was over."""
        return self.outcome in tuple(Lost)

    @property
    def has_failed(self) -> bool:
        """True if the run broke off: it crashed, became unstable, or was lost."""
        return self.is_lost or self.outcome in (Outcome.CRASHED.name.lower(), Outcome.UNSTABLE.name.lower())

    @property
    def error_class(self) -> str:
        """Class of what ended the run: `none` (it was done), `simulation` (the physics broke down), or `policy`.

        `policy` is the program: it ran into a limit, gave up, crashed, or its process died. What the machine or a
        policy's server does is no result: such a run is repeated, and has none until it ends on its own.
        """
        if self.is_done or self.is_unjudged:
            return "none"
        return "simulation" if self.outcome == Outcome.UNSTABLE.name.lower() else "policy"

    def counts_under(self, limits: Mapping[str, float]) -> bool:
        """Return whether the result is valid under these limits; only that of a lost run depends on them."""
        return not self.is_lost or self.limits == limits

    @property
    def is_scored(self) -> bool:
        """True if there were points to earn; other runs show nothing, and do not count in shares and intervals."""
        return self.reachable > 0.0

    @property
    def is_unjudged(self) -> bool:
        """True if nothing went wrong in a run without points to earn, such as one without an order."""
        return not self.is_scored and (self.is_done or self.outcome == Outcome.NO_ORDER.name.lower())

    @property
    def share(self) -> float:
        """Share of the reachable points; 0 for a trial that has none."""
        return self.points / self.reachable if self.is_scored else 0.0

    @property
    def ending(self) -> str:
        """Ending of the run, in words."""
        return OUTCOMES.get(self.outcome, "lost: " + self.outcome.replace("_", " "))

    def check(self) -> None:
        """Check the values of a result that was reported.

        Raises:
            ResultError: no run has them.
        """
        document = {each.name: getattr(self, each.name) for each in fields(self)} | {"log": list(self.log)}
        if fault := _find_excess(document) or find_misfit(document, RESULT_FORM) or _find_impossible(document):
            raise ResultError(fault)

    def as_json(self) -> dict[str, Any]:
        """Return the result as JSON values, not copied: copies would take most of the time of a report."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @classmethod
    def from_json(cls, document: Any) -> Result:
        """Read the output of `as_json`.

        Raises:
            ResultError: the document is no result.
        """
        names = {each.name for each in fields(cls)}
        if not isinstance(document, Mapping) or set(document) != names:
            raise ResultError("not a result of this version of Cellwright")
        if misfit := find_misfit({"log": document["log"]}, {"log": RESULT_FORM["log"]}):
            raise ResultError(f"not a result of this version of Cellwright: {misfit}")
        result = cls(**{**document, "log": tuple(document["log"])})
        try:
            result.check()
        except ResultError as error:
            raise ResultError(f"not a result of this version of Cellwright: {error}") from None
        return result

    @property
    def line(self) -> bytes:
        """The result as a sealed line of a results file."""
        return sealed(json.dumps(self.as_json(), separators=(",", ":"), allow_nan=False))

    @classmethod
    def from_line(cls, line: bytes) -> Result:
        """Read a `line`.

        Raises:
            ResultError: it is no result, or was changed after it was written.
        """
        try:
            return cls.from_json(json.loads(unsealed(line)))
        except (ValueError, RecursionError, SealError) as error:
            raise ResultError(str(error)) from error


def _find_excess(document: Mapping[str, Any]) -> str:
    """Return why a JSON value has too many levels for code that follows them by calls; empty if it has not."""
    level: list[Any] = [document]
    for _ in range(_MAX_LEVELS):
        inner = (each.values() if isinstance(each, Mapping) else each for each in level)
        level = [each for group in inner for each in group if isinstance(each, Mapping | list)]
        if not level:
            return ""
    return f"it has more than {_MAX_LEVELS} levels"


def _find_impossible(document: Mapping[str, Any]) -> str:
    """Return why no run has the values of a result that has the right form; empty if one may."""
    if document["outcome"] not in OUTCOMES and document["outcome"] not in tuple(Lost):
        return f"unknown outcome {document['outcome']!r:.40}"
    if negative := [name for name in ("points", "reachable", "wall", "simulated", "steps") if document[name] < 0.0]:
        return f"{negative[0]} must not be negative (got {document[negative[0]]:g})"
    if document["points"] > document["reachable"] + POINT_TOLERANCE:
        return f"points must be at most the attainable {document['reachable']:g} (got {document['points']:g})"
    return ""
