"""Results of an evaluation that may be in progress, read from its folders as they come.

Files may be those of another machine, and of several shards. Only new bytes are read. A result is kept without its log
and its events, which are read again for the one run that a page shows.
"""

from __future__ import annotations

import json
import os
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cellwright.running.evaluation.plan.job import repeated_key
from cellwright.running.evaluation.results.folder import LOGS, PLAN_NAME, RESULTS_NAME, read_plan
from cellwright.running.evaluation.results.measures import parts
from cellwright.running.evaluation.results.result import Result, ResultError
from cellwright.util.errors import UsageError
from cellwright.util.files import open_below

_CHUNK = 4 << 20  # [bytes] at once, so that a page of a large evaluation answers meanwhile
_TAIL = 16384  # [bytes] of a log that are read
_RECENT = 50  # results whose times give the rate
_WORDS = ("state", "order_id", "kit_type", "tray_id", "refusal", "link", "obstacle", "power", "reason", "total")
"""Fields of events that people read."""


@dataclass(frozen=True, slots=True)
class Row:
    """Result in a file.

    Attributes:
        result: the result, without log, timeline and what its parts tell besides distances.
        folder: folder of the file.
        begin: first byte of its line.
        size: length of its line [bytes].
        number: order in which the rows were read, over all folders.
    """

    result: Result
    folder: Path
    begin: int
    size: int
    number: int


class ResultsReader:
    """Reader of the results in one folder, as they come.

    Args:
        folder: the folder.
        number: returns the number of the next row.
    """

    def __init__(self, folder: Path, number: Callable[[], int]) -> None:
        self.folder = folder
        self.path = folder / RESULTS_NAME
        self.rows: dict[str, Row] = {}
        """Rows by key; of a key that comes twice the later."""
        self.notice = ""
        """Fault of the file, in one line; empty if there is none."""
        self.is_read = False
        """True once the file has been read to its end."""
        self._number = number
        self._begin = 0
        self._line = 0
        self._file: tuple[int, int] | None = None

    def read(self) -> bool:
        """Read what is new, up to `_CHUNK` bytes; return whether anything has changed. A half line waits."""
        had_rows = bool(self.rows)
        try:
            state = os.lstat(self.path)
            if (state.st_dev, state.st_ino) != self._file or state.st_size < self._begin:
                self.rows, self.notice, self._begin, self._line = {}, "", 0, 0  # another file, or a shorter one
                self._file = state.st_dev, state.st_ino
            if state.st_size == self._begin:
                self.is_read = True
                return had_rows and not self.rows
            with open_below(self.folder, RESULTS_NAME) as file:
                file.seek(self._begin)
                content = file.read(_CHUNK)
        except FileNotFoundError:
            self.notice = f"{self.path}: there is none" if self._begin else ""
            self.is_read = True
            return False
        except (OSError, ValueError) as error:
            self.notice = f"{self.path}: cannot be read: {getattr(error, 'strerror', None) or error}"
            self.is_read = True
            return False
        whole = content.rfind(b"\n") + 1
        if not whole and len(content) < _CHUNK:
            self.is_read = True
            return False
        *lines, _half = content.split(b"\n")
        # no result is as long as a chunk
        for line in lines or [content[:-1]]:
            self._take(line)
        self.is_read = self._begin + len(content) - whole >= state.st_size
        return True

    def _take(self, line: bytes) -> None:
        begin, self._begin, self._line = self._begin, self._begin + len(line) + 1, self._line + 1
        try:
            result = Result.from_line(line)
        except ResultError as error:
            self.notice = self.notice or f"{self.path}:{self._line}: {str(error)[:200]}"
            return
        self.rows.pop(result.key, None)  # so that the newest comes last
        self.rows[result.key] = Row(_without_details(result), self.folder, begin, len(line), self._number())


def _without_details(result: Result) -> Result:
    """Return a result with what statistics need, such as distances of its parts, and nothing else."""
    kept = [{"distance": part["distance"]} for part in parts(result)]
    score = {"orders": [{"kits": [{"parts": kept}]}]} if kept else {}
    return replace(result, score=score, timeline={}, log=(), command="", state_hash="")


class FollowedEvaluation:
    """An evaluation in one or several folders, with one plan.

    Args:
        folders: its folders.
        clock: wall time [s].

    Raises:
        UsageError: a folder has no plan, or another one.
        OSError: a plan cannot be read.
    """

    def __init__(self, folders: Sequence[Path], clock: Callable[[], float] = time.monotonic) -> None:
        self.folders = folders
        self._clock = clock
        self._count = 0
        self._plan_state = _state_of(folders[0] / PLAN_NAME)
        self.plan: Mapping[str, Any] = read_plan(folders[0])
        for folder in folders[1:]:
            if read_plan(folder) != self.plan:
                raise UsageError(f"{folder}: does not belong to {folders[0]}; give shards of one evaluation")
        self._readers = [ResultsReader(folder, self._next) for folder in folders]
        self._arrivals: deque[tuple[float, int]] = deque(maxlen=_RECENT)  # [s], number of results by then
        self._plan_notice = ""
        self._found: Mapping[str, Row] = {}
        self._set_plan()

    def read(self) -> bool:
        """Read what is new; return whether anything was. Call it until it returns False to be up to date."""
        has_plan = self._read_plan()
        was_read = all(reader.is_read for reader in self._readers)
        has_results = sum(reader.read() for reader in self._readers) > 0
        if not has_results and not has_plan:
            return False
        before, self._found = len(self._found), self._find()
        if not was_read or len(self._found) < before:
            self._arrivals.clear()  # their times are not known
        if not self._arrivals or len(self._found) > before:
            self._arrivals.append((self._clock(), len(self._found)))
        return True

    @property
    def rows(self) -> Mapping[str, Row]:
        """Rows of valid results by key, in the order of the plan, without those of repetitions."""
        return {key: self._found[key] for key in self._order if key in self._found and key not in self._repeated}

    @property
    def done(self) -> int:
        """Number of runs with a result, repetitions included."""
        return len(self._found)

    @property
    def counts(self) -> Mapping[str, int]:
        """Number of planned runs of each trial, without repetitions."""
        return self._trials

    @property
    def notices(self) -> list[str]:
        """Faults of the files, a line each."""
        return list(filter(None, [self._plan_notice, *(reader.notice for reader in self._readers)]))

    def rate(self) -> float | None:
        """Return results per second lately; None if it is not known."""
        if len(self._arrivals) < 2:
            return None
        (begin, before), (_, after) = self._arrivals[0], self._arrivals[-1]
        seconds = self._clock() - begin
        return (after - before) / seconds if seconds > 0.0 and after > before else None

    def since_last(self) -> float | None:
        """Return how long ago the last result came [s]; None if none has come since the first look."""
        return self._clock() - self._arrivals[-1][0] if len(self._arrivals) > 1 else None

    def _next(self) -> int:
        self._count += 1
        return self._count

    def _read_plan(self) -> bool:
        """Read the plan again if its file has changed; return whether it has."""
        path = self.folders[0] / PLAN_NAME
        state = _state_of(path)
        if state == self._plan_state:
            return False
        self._plan_state = state
        try:
            self.plan = read_plan(self.folders[0])
        except (OSError, UsageError) as error:
            self._plan_notice = str(error) if isinstance(error, UsageError) else f"{path}: {error.strerror or error}"
            return False
        self._set_plan()
        self._plan_notice = ""
        return True

    def _set_plan(self) -> None:
        self._order = [run["key"] for run in self.plan["runs"]]
        known = set(self._order)
        self._repeated = {repeated_key(key) for key in self._order} & known
        self._trials: dict[str, int] = {}
        for run in self.plan["runs"]:
            self._trials[run["trial"]] = self._trials.get(run["trial"], 0) + (run["key"] not in self._repeated)
        self._known = known
        self._found = self._find()

    def _find(self) -> dict[str, Row]:
        """Return the valid rows; of a run with several, that in the first folder."""
        found: dict[str, Row] = {}
        for reader in self._readers:
            for key, row in reader.rows.items():
                if key in self._known and row.result.counts_under(self.plan["limits"]):
                    found.setdefault(key, row)
        return found


def _state_of(path: Path) -> tuple[int, ...]:
    """Return what changes with a file; empty if it cannot be seen."""
    try:
        state = path.stat()
    except OSError:
        return ()
    return state.st_mtime_ns, state.st_size, state.st_ino


def whole_result(row: Row) -> Result:
    """Read a result again, with all that it holds.

    Raises:
        OSError: the file cannot be read.
        UsageError: the result is no longer there.
    """
    path = row.folder / RESULTS_NAME
    with open_below(row.folder, RESULTS_NAME) as file:
        file.seek(row.begin)
        line = file.read(row.size)
    try:
        result = Result.from_line(line)
    except ResultError as error:
        raise UsageError(f"{path}: the result is no longer there") from error
    if result.key != row.result.key:
        raise UsageError(f"{path}: the result is no longer there")
    return result


def log_of(row: Row, suffix: str) -> list[str]:
    """Return the last whole lines of a log of a run, such as `.log` or `.jsonl`; none if it cannot be read."""
    result = row.result
    name = Path(result.log_name).with_suffix(suffix)
    try:
        with open_below(row.folder, LOGS / name) as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(0, size - _TAIL))
            text = file.read(_TAIL).decode("utf-8", errors="replace")
    except (OSError, ValueError):
        return []
    lines = text.split("\n")
    return lines[size > _TAIL : -1] if text.endswith("\n") else lines[size > _TAIL :]


def event_lines(lines: Iterable[str]) -> Iterator[str]:
    """Yield the events of a run, from lines of its log (`run_log`), with their times."""
    for line in lines:
        try:
            event = json.loads(line)
        except (ValueError, RecursionError):
            continue  # cut short
        if not isinstance(event, dict) or event.get("kind") in ("run", "result"):
            continue
        if isinstance(event.get("time"), int | float):
            words = (str(event[name]) for name in _WORDS if isinstance(event.get(name), str | int | float))
            yield f"{event['time']:8.2f} s  {event.get('kind')}: {', '.join(words)}".rstrip(": ")
