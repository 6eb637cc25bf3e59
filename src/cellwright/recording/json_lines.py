"""A file of JSON values, one a line, that grows while something goes on.

Every line is handed to the operating system whole and at once, so whatever ends the program, SIGKILL too, what was
written before is in the file. Only the line being written at that moment can be cut short; `read_json_lines` leaves
such a last line out.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from cellwright.errors import UsageError


class JsonLines:
    """Writes a file of JSON lines.

    A disk that fails is no reason to lose what is going on: the first line that cannot be written is reported, and
    nothing is written from then on, so that what is in the file has no gap.

    Args:
        path: the file.
        append: go on behind what the file holds, behind a last line that was cut short too; else begin it anew.
        report: takes a line about a file that can be written no more.

    Raises:
        UsageError: the file cannot be opened.
    """

    def __init__(self, path: Path, *, append: bool = False, report: Callable[[str], None] = lambda _line: None) -> None:
        self.path = path
        self._report = report
        try:
            self._file: int | None = os.open(
                path, os.O_WRONLY | os.O_CREAT | (os.O_APPEND if append else os.O_TRUNC), 0o666
            )
            if append and _is_cut_short(path):
                os.write(self._file, b"\n")
        except OSError as error:
            raise UsageError(f"{path}: cannot be written: {error.strerror or error}") from None

    @property
    def is_writing(self) -> bool:
        """Whether lines still go to the file."""
        return self._file is not None

    def write(self, value: Mapping[str, Any]) -> None:
        """Add a line.

        Raises:
            ValueError: the value holds a number that JSON has not, or something that is no JSON value.
        """
        if self._file is None:
            return
        rest = memoryview(f"{json.dumps(value, allow_nan=False)}\n".encode())
        try:
            while rest:
                rest = rest[os.write(self._file, rest) :]
        except OSError as error:
            self._report(f"{self.path}: can be written no more: {error.strerror or error}")
            self.close()

    def close(self) -> None:
        """Write no more."""
        if self._file is not None:
            file, self._file = self._file, None
            try:
                os.close(file)
            except OSError as error:  # some file systems tell only now that the disk is full
                self._report(f"{self.path}: may be incomplete: {error.strerror or error}")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def read_json_lines(path: Path) -> list[dict[str, Any]]:
    """The values in a file of JSON lines; lines that were cut short are left out.

    Raises:
        UsageError: the file cannot be read.
    """
    try:
        lines = path.read_bytes().split(b"\n")
    except OSError as error:
        raise UsageError(f"{path}: cannot be read: {error.strerror or error}") from None
    values = (_value(line) for line in lines)
    return [value for value in values if value is not None]


def _value(line: bytes) -> dict[str, Any] | None:
    try:
        value = json.loads(line)
    except ValueError:
        return None
    return value if isinstance(value, dict) else None


def _is_cut_short(path: Path) -> bool:
    """Whether the last line of a file has no end."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(size - 1, 0))
        return file.read(1) not in (b"", b"\n")
