"""A file of JSON values, one a line, that grows while something goes on.

It outlives whatever ends the program, as any `LineFile`; `read_json_lines` leaves out a line that was cut short.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Self

from cellwright.util.errors import UsageError
from cellwright.util.line_file import LineFile


class JsonLines:
    """Writes a file of JSON lines; see `LineFile` for its arguments, and for what becomes of a disk that fails.

    Raises:
        UsageError: the file cannot be opened.
    """

    def __init__(self, path: Path, *, append: bool = False, report: Callable[[str], None] = lambda _line: None) -> None:
        self.path = path
        try:
            self._lines = LineFile(path, append=append, report=report)
        except OSError as error:
            raise UsageError(f"{path}: cannot be written: {error.strerror or error}") from None

    @property
    def is_writing(self) -> bool:
        """Whether lines still go to the file."""
        return self._lines.is_writing

    @property
    def is_whole(self) -> bool:
        """Whether all lines have gone to the file so far."""
        return self._lines.is_whole

    def write(self, value: Mapping[str, Any]) -> None:
        """Add a line.

        Raises:
            ValueError: the value holds a number that JSON has not, or something that is no JSON value.
        """
        if self._lines.is_writing:
            self._lines.write(json.dumps(value, allow_nan=False))

    def close(self) -> None:
        """Write no more."""
        self._lines.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
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
    except (ValueError, RecursionError):
        return None
    return value if isinstance(value, dict) else None
