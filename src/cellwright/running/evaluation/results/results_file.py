"""File with the results of an evaluation: a sealed line for each, on the disk at once."""

from __future__ import annotations

import errno
import json
import os
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import Self

from cellwright.config.parsing.tree import Place, Problem
from cellwright.running.evaluation.results.folder import RESULTS_NAME, read_regular, refuse_device
from cellwright.running.evaluation.results.result import Result, ResultError
from cellwright.util.errors import UsageError, printable


class ResultsFile:
    """The results in a folder, which one evaluation at a time may use.

    If a key comes twice, the later line counts. A last line that was only half written, because the process was killed,
    is removed. A line that is damaged, or was changed after it was written, is not believed; it stays in the file.

    Args:
        folder: created if it does not exist.

    Attributes:
        notices: faults of the file, a line each.

    Raises:
        UsageError: another evaluation uses the folder, or no line of the file is a result.
        OSError: the folder is not writable.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / RESULTS_NAME
        refuse_device(self.path)
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


@dataclass(frozen=True, slots=True)
class _Parsed:
    """Content of a results file.

    Attributes:
        results: the results by key.
        size: number of bytes up to the end of the last whole line.
        notices: faults of lines; nothing of those whose run has a later, valid one.
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
    # the process was killed while it wrote the last
    *lines, cut_short = content.split(b"\n")
    for number, line in enumerate(lines, start=1):
        try:
            result = Result.from_line(line)
        except ResultError as error:
            faults[number], keys[number] = str(error), _key_of(line)
            # the run's newest line is damaged, so an older one does not count
            results.pop(keys[number], None)
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
            # far behind the end: a locked byte could not be read
            os.lseek(descriptor, 0x7FFF0000, os.SEEK_SET)
            try:
                msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
            finally:
                # where readers and writers expect to be
                os.lseek(descriptor, before, os.SEEK_SET)
        else:
            import fcntl

            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
