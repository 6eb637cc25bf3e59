"""Results on disk: a line of JSON each, there to stay as soon as it is written."""

from __future__ import annotations

import errno
import json
import os
import sys
from collections.abc import Mapping
from contextlib import suppress
from io import FileIO
from pathlib import Path
from typing import Self

from cellwright.config.parsing.problems import Place, Problem
from cellwright.running.evaluation.result import Result, ResultError
from cellwright.util.errors import UsageError

RESULTS = "results.jsonl"


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
        self.path = folder / RESULTS
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
