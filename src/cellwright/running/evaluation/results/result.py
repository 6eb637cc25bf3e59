"""Results of an evaluation: their form, and the file that holds them.

A form is a type, `Maybe` one, a list with the form of its items, a mapping or `Each`. A mapping holds the forms of the
required entries, `Each` the form of all values.
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
from cellwright.running.evaluation.plan.job import Job, RunLimits
from cellwright.running.evaluation.results.seal import SealError, sealed, unsealed
from cellwright.running.run import Outcome
from cellwright.util.errors import CellwrightError, UsageError, printable
from cellwright.util.files import open_below

_MAX_LEVELS = 16  # of a result's lists and objects; it has 8
_NAMES = {str: "a string", bool: "true or false", int: "a whole number", float: "a finite number"}
OUTCOMES = {outcome.name.lower(): str(outcome) for outcome in Outcome}
"""Outcomes of a run, by their words in files; the values are for people."""
RESULTS_NAME = "results.jsonl"
POINT_TOLERANCE = 1e-6
"""Rounding that sums of points may have."""


@dataclass(frozen=True, slots=True)
class Maybe:
    """Form of an optional value: None, an empty mapping, or a value of `form`."""

    form: Any


@dataclass(frozen=True, slots=True)
class Each:
    """Form of a mapping whose values all have one form."""

    form: Any


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
}
"""Form of a result."""


def find_misfit(value: object, form: Any, key: str = "") -> str:
    """Return the first place where a JSON value does not fit the form, and what belongs there; empty if it fits."""
    match form:
        case Maybe():
            return "" if value in (None, {}) else find_misfit(value, form.form, key)
        case Each():
            if not isinstance(value, Mapping):
                return f"{key} must be an object"
            return _first(find_misfit(each, form.form, f"{key}.{name}") for name, each in value.items())
        case [item]:
            if not isinstance(value, list):
                return f"{key} must be a list"
            return _first(find_misfit(each, item, f"{key}[{number}]") for number, each in enumerate(value))
        case Mapping():
            if not isinstance(value, Mapping):
                return f"{key} must be an object"
            prefix = f"{key}." if key else ""
            if missing := [name for name in form if name not in value]:
                return f"{prefix}{missing[0]} is missing"
            return _first(find_misfit(value[name], inner, f"{prefix}{name}") for name, inner in form.items())
        case _:
            return "" if _is_of(value, form) else f"{key} must be {_NAMES[form]}"


def _is_of(value: object, kind: type) -> bool:
    if kind is float:
        return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max
    return isinstance(value, kind) and (kind is not int or not isinstance(value, bool))


def _first(misfits: Iterable[str]) -> str:
    return next(filter(None, misfits), "")


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
        reason: why it was not done, in one line; empty if it was.
        state_hash: SHA-256 of the whole last state.
        log: the last lines of its log, if it was not done.
        command: the command that repeats the run alone.
        overrides: values that replaced those of the trial's files, as YAML texts by key.
        over: `socket` if the program ran in a process of its own; empty if it ran in the referee's.
        verified: True if its commands gave the same result in a process without the program.
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
            overrides={each.key: each.value for each in job.trial.overrides},
            over=job.over,
            **content,
        )

    @property
    def name(self) -> str:
        """Name of the run for people."""
        return f"{self.trial} seed {self.seed}"

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
    if negative := [name for name in ("points", "reachable", "wall", "simulated") if document[name] < 0.0]:
        return f"{negative[0]} must not be negative (got {document[negative[0]]:g})"
    if document["points"] > document["reachable"] + POINT_TOLERANCE:
        return f"points must be at most the attainable {document['reachable']:g} (got {document['points']:g})"
    return ""


class ResultsFile:
    """The results in a folder, which one evaluation at a time may use.

    If a key comes twice, the later line counts. A last line that was only half written, because the process was killed,
    is removed. A line that is damaged, or was changed after it was written, is not believed; it stays in the file.

    Args:
        folder: created if it does not exist.

    Attributes:
        notices: what is wrong with the file, a line each.

    Raises:
        UsageError: another evaluation uses the folder, or no line of the file is a result.
        OSError: the folder is not writable.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / RESULTS_NAME
        _refuse_device(self.path)
        self._results: dict[str, Result] = {}
        self._written: dict[str, Result] = {}
        self._file: FileIO = self.path.open("a+b", buffering=0)
        self._size = 0  # bytes that are known to be sound
        self._state: tuple[int, ...] = ()
        try:
            if not _lock(self._file.fileno()):
                raise UsageError(f"{folder}: in use by another evaluation; use another folder")
            self._read()
        except BaseException:
            self._file.close()
            raise

    @property
    def results(self) -> Mapping[str, Result]:
        """Results by key."""
        return self._results

    def forget(self, keys: Iterable[str]) -> None:
        """Remove results from `results`; their lines stay in the file until later ones of the same key count."""
        for key in keys:
            self._results.pop(key, None)

    def append(self, *results: Result) -> None:
        """Add results; they are on the disk when this returns.

        Raises:
            OSError: nothing of them could be written; `results` holds them all the same.
        """
        self._results |= {result.key: result for result in results}
        self.restore()
        self._write(results)
        self._written |= {result.key: result for result in results}

    def restore(self) -> None:
        """Write the results again if another program has changed the file since the last write; a notice says so.

        Raises:
            OSError: the file was removed or replaced, or cannot be written.
        """
        if not os.fstat(self._file.fileno()).st_nlink or not self._is_in_place():
            raise FileNotFoundError(errno.ENOENT, "file was removed or replaced", str(self.path))
        if self._state == _state_of(self._file.fileno()):
            return
        self._file.seek(0)
        try:
            is_changed = _parse(self._file.readall(), self.path).results != self._written
        except UsageError:
            is_changed = True
        if is_changed:
            self.notices.append(f"{self.path}: changed by another program meanwhile; written again")
            self._file.truncate(0)
            self._size = 0
            self._write(self._written.values())
        self._state = _state_of(self._file.fileno())

    def close(self) -> None:
        """Release the folder for other evaluations."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _read(self) -> None:
        self._file.seek(0)
        found = _parse(self._file.readall(), self.path)
        self._results, self._size, self.notices = {**found.results}, found.size, found.notices
        self._written = found.results
        self._file.truncate(self._size)
        self._file.seek(0, os.SEEK_END)
        self._state = _state_of(self._file.fileno())

    def _write(self, results: Iterable[Result]) -> None:
        rest = memoryview(b"".join(each.line + b"\n" for each in results))
        size = self._size + len(rest)
        try:
            while rest:
                rest = rest[self._file.write(rest) or 0 :]
            os.fsync(self._file.fileno())
        except OSError:
            with suppress(OSError):
                self._file.truncate(self._size)
            raise
        self._size = size
        self._state = _state_of(self._file.fileno())

    def _is_in_place(self) -> bool:
        """Return whether the path still leads to the file."""
        try:
            return os.path.samestat(self.path.stat(), os.fstat(self._file.fileno()))
        except OSError:
            return False


def _state_of(descriptor: int) -> tuple[int, ...]:
    """Return what changes with a file; unlike the time of its content, no program can set the second."""
    state = os.fstat(descriptor)
    return state.st_size, state.st_ctime_ns


def read_results(folder: Path, notices: list[str] | None = None) -> dict[str, Result]:
    """Return the results in a folder by key, as `ResultsFile` does. The folder may be in use, and is not changed.

    Args:
        folder: the folder.
        notices: receives what is wrong with the file, a line each.

    Raises:
        UsageError: no line of the file is a result.
        OSError: it cannot be read.
    """
    path = folder / RESULTS_NAME
    found = _parse(read_regular(path), path)
    if notices is not None:
        notices += found.notices
    return found.results


def read_regular(path: Path) -> bytes:
    """Return the content of a file beside the results.

    Raises:
        UsageError: it is a link, or no regular file.
        OSError: it cannot be read.
    """
    _refuse_device(path)
    try:
        with open_below(path.parent, path.name) as file:
            return file.read()
    except ValueError as error:
        raise UsageError(f"{path}: {error}; use another folder") from None


def _refuse_device(path: Path) -> None:
    if path.is_symlink():  # the program of a run may have put it there
        raise UsageError(f"{path}: it is a link, not a regular file; use another folder")
    if path.exists() and not path.is_file():  # a device may be read without end
        raise UsageError(f"{path}: not a regular file; use another folder")


@dataclass(frozen=True, slots=True)
class _Parsed:
    """Content of a results file.

    Attributes:
        results: the results by key.
        size: number of bytes up to the end of the last whole line.
        notices: what is wrong with lines; nothing of those whose run has a later, valid one.
    """

    results: dict[str, Result]
    size: int
    notices: list[str]


def _parse(content: bytes, path: Path) -> _Parsed:
    """Read the lines of a results file.

    Raises:
        UsageError: there are lines, and none is a result, valid or damaged.
    """
    results: dict[str, Result] = {}
    faults: dict[int, str] = {}
    keys: dict[int, str] = {}
    *lines, cut_short = content.split(b"\n")  # the process was killed while it wrote the last
    for number, line in enumerate(lines, start=1):
        try:
            result = Result.from_line(line)
        except ResultError as error:
            faults[number], keys[number] = str(error), _key_of(line)
            results.pop(keys[number], None)  # the run's newest line is damaged, so an older one does not count
        else:
            results.pop(result.key, None)
            results[result.key] = result
    if lines and not results and not any(keys.values()):
        message = f"{faults[1]}; use another folder, or remove the file to start over"
        raise UsageError(str(Problem(Place(0, str(path), 1), "", message)))
    notices = [
        str(Problem(Place(0, str(path), number), "", f"{printable(fault, 200)}; this line is not believed"))
        for number, fault in faults.items()
        if keys[number] not in results
    ]
    return _Parsed(results, len(content) - len(cut_short), notices)


def _key_of(line: bytes) -> str:
    """Return the key in a line that is no valid result; empty if it has none."""
    try:
        document = json.loads(line)
    except (ValueError, RecursionError):
        return ""
    key = document.get("key") if isinstance(document, dict) else None
    return key if isinstance(key, str) else ""


def _lock(descriptor: int) -> bool:
    """Lock the file for this process, until it closes the file or ends; False if another process has locked it."""
    try:
        if sys.platform == "win32":
            import msvcrt

            before = os.lseek(descriptor, 0, os.SEEK_CUR)
            os.lseek(descriptor, 0x7FFF0000, os.SEEK_SET)  # far behind the end: a locked byte could not be read
            try:
                msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
            finally:
                os.lseek(descriptor, before, os.SEEK_SET)  # where readers and writers expect to be
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
