"""Results of an evaluation: their form, and the file that holds them.

A form is a type, `Maybe` one, a list with the form of its items, a mapping with the forms of the entries that it has to
have, or `Each` with the form of all values of a mapping.
"""

from __future__ import annotations

import errno
import json
import os
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, fields
from enum import StrEnum
from io import FileIO
from pathlib import Path
from typing import Any, Self

from cellwright.config.parsing.tree import Place, Problem
from cellwright.running.evaluation.job import Job
from cellwright.running.evaluation.process import Limits
from cellwright.running.run import Outcome
from cellwright.util.errors import CellwrightError, UsageError


@dataclass(frozen=True, slots=True)
class Maybe:
    """Either nothing, which is None or an empty mapping, or of a form."""

    form: Any


@dataclass(frozen=True, slots=True)
class Each:
    """A mapping whose values all have a form."""

    form: Any


_PART = {
    "type": str,
    "sentence": str,
    **dict.fromkeys(("presence", "pose", "reachable_presence", "reachable_pose"), float),
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
    "score": Maybe({"orders": [{"order_id": str, "kits": [_KIT]}]}),
    "timeline": Maybe(_TIMELINE),
    "log": [str],
}
"""The form of a result."""


def find_misfit(value: object, form: Any, key: str = "") -> str:
    """The first place where a JSON value has not the form, and what should be there; empty where it fits."""
    match form:
        case Maybe():
            return "" if value in (None, {}) else find_misfit(value, form.form, key)
        case Each():
            if not isinstance(value, Mapping):
                return f"{key} should be an object"
            return _first(find_misfit(each, form.form, f"{key}.{name}") for name, each in value.items())
        case [item]:
            if not isinstance(value, list):
                return f"{key} should be a list"
            return _first(find_misfit(each, item, f"{key}[{number}]") for number, each in enumerate(value))
        case Mapping():
            if not isinstance(value, Mapping):
                return f"{key} should be an object"
            way = f"{key}." if key else ""
            if missing := [name for name in form if name not in value]:
                return f"{way}{missing[0]} is missing"
            return _first(find_misfit(value[name], inner, f"{way}{name}") for name, inner in form.items())
        case _:
            return "" if _is_of(value, form) else f"{key} should be {_NAMES[form]}"


_NAMES = {str: "a text", bool: "true or false", int: "a whole number", float: "a finite number"}


def _is_of(value: object, kind: type) -> bool:
    if kind is float:
        return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max
    return isinstance(value, kind) and (kind is not int or not isinstance(value, bool))


def _first(misfits: Iterable[str]) -> str:
    return next(filter(None, misfits), "")


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
        outcome: a name of `Outcome` in small letters, or a value of `Lost`.
        points: what it earned; 0 when its process could not say so any more.
        reachable: the most points that anybody can earn in the trial.
        best: what its orders would earn if nothing were out of reach.
        wall: time it took on the wall clock [s].
        simulated: simulation time that passed [s].
        reason: why it was not done, in a line; empty when it was.
        state_hash: SHA-256 of the whole last state.
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

    @classmethod
    def of(cls, job: Job, limits: Limits, **content: Any) -> Result:
        """The result of a job that was worked within these limits; `content` are the fields that neither says."""
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
            **content,
        )

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
        if misfit := find_misfit(document, RESULT_FORM):
            raise ResultError(f"not a result of this version of Cellwright: {misfit}")
        return cls(**{**document, "log": tuple(document["log"])})


RESULTS_NAME = "results.jsonl"


class ResultsFile:
    """The results in a folder, which one evaluation at a time may have.

    Where a key comes twice, the later line counts. A last line that was only half written, because the process was
    killed, is taken away.

    Args:
        folder: made if it is not there.

    Raises:
        UsageError: another evaluation has the folder, or the file holds something else.
        OSError: the folder cannot be written to.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / RESULTS_NAME
        if self.path.exists() and not self.path.is_file():  # a device may be read without end
            raise UsageError(f"{self.path}: no plain file; take another folder")
        self._results: dict[str, Result] = {}
        self._file: FileIO = self.path.open("a+b", buffering=0)
        self._size = 0  # of what is known to be sound
        try:
            if not _lock(self._file.fileno()):
                raise UsageError(f"{folder}: another evaluation is at work in this folder")
            self._read()
        except BaseException:
            self._file.close()
            raise

    @property
    def results(self) -> Mapping[str, Result]:
        """The results by key."""
        return self._results

    def append(self, result: Result) -> None:
        """Add a result; when this returns, it is on the disk.

        Raises:
            OSError: it is not, nor is a half of it; it is among the results all the same.
        """
        self._results[result.key] = result
        line = json.dumps(result.as_json(), separators=(",", ":"), allow_nan=False)
        rest = memoryview(f"{line}\n".encode())
        size = self._size + len(rest)
        try:
            if not os.fstat(self._file.fileno()).st_nlink:
                raise FileNotFoundError(errno.ENOENT, "it has been removed", str(self.path))
            while rest:
                rest = rest[self._file.write(rest) or 0 :]
            os.fsync(self._file.fileno())
        except OSError:
            with suppress(OSError):
                self._file.truncate(self._size)
            raise
        self._size = size

    def close(self) -> None:
        """Let others have the folder."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _read(self) -> None:
        self._file.seek(0)
        *lines, _cut_short = self._file.readall().split(b"\n")  # the process was killed while it wrote the last
        for number, line in enumerate(lines, start=1):
            self._size += len(line) + 1
            try:
                result = Result.from_json(json.loads(line))
            except (ValueError, RecursionError, ResultError) as error:
                message = f"{error}; take another folder, or remove the file to begin anew"
                raise UsageError(str(Problem(Place(0, str(self.path), number), "", message))) from error
            self._results[result.key] = result
        self._file.truncate(self._size)
        self._file.seek(0, os.SEEK_END)


def _lock(descriptor: int) -> bool:
    """Take the file for this process, until it closes it or ends; False when another process has it."""
    try:
        if sys.platform == "win32":
            import msvcrt

            before = os.lseek(descriptor, 0, os.SEEK_CUR)
            os.lseek(descriptor, 0x7FFF0000, os.SEEK_SET)  # far behind the end: a locked byte could not be read
            try:
                msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
            finally:
                os.lseek(descriptor, before, os.SEEK_SET)  # where those who read and write believe to be
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
