"""Results on disk: a line of JSON each, there to stay as soon as it is written."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping
from io import BufferedRandom
from pathlib import Path
from types import TracebackType
from typing import Self

from cellwright.description.reading.problems import Place, Problem
from cellwright.errors import UsageError
from cellwright.evaluation.result import Result, ResultError

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
        self._results: dict[str, Result] = {}
        self._file: BufferedRandom = self.path.open("a+b")
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
        """Add a result; when this returns, it is on the disk."""
        line = json.dumps(result.as_json(), separators=(",", ":"), allow_nan=False)
        self._file.write(f"{line}\n".encode())
        self._file.flush()
        os.fsync(self._file.fileno())
        self._results[result.key] = result

    def close(self) -> None:
        """Let others have the folder."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _read(self) -> None:
        self._file.seek(0)
        sound = 0
        for number, line in enumerate(self._file, start=1):
            if not line.endswith(b"\n"):
                break  # the process was killed while it wrote this
            sound += len(line)
            try:
                result = Result.from_json(json.loads(line))
            except (ValueError, RecursionError, ResultError) as error:
                message = f"{error}; take another folder, or remove the file to begin anew"
                raise UsageError(str(Problem(Place(0, str(self.path), number), "", message))) from error
            self._results[result.key] = result
        self._file.truncate(sound)
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
