"""A text file that grows line by line while something goes on, and keeps what was written whatever happens.

Every line is handed to the operating system whole and at once: SIGKILL takes away at most the end of the line that is
being written at that moment.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from cellwright.util.atomic_file import open_to_read

_BYTES_AS_THEY_ARE: int = getattr(os, "O_BINARY", 0)  # without it Windows would write two characters for a line end


class LineFile:
    """Writes lines to a file.

    A disk that fails is no reason to lose what is going on: the first line that cannot be written is reported, and
    nothing is written from then on, so that what is in the file has no gap.

    Args:
        path: the file.
        append: go on behind what the file holds, behind a last line that was cut short too; else begin it anew.
        report: takes a line about a file that can be written no more.

    Raises:
        OSError: the file cannot be opened.
    """

    def __init__(self, path: Path, *, append: bool = False, report: Callable[[str], None] = lambda _line: None) -> None:
        self.path = path
        self.is_whole = True
        """Whether all lines have gone to the file so far."""
        self._report = report
        how = os.O_WRONLY | os.O_CREAT | (os.O_APPEND if append else os.O_TRUNC)
        self._file: int | None = os.open(path, how | _BYTES_AS_THEY_ARE, 0o666)
        if append and _is_cut_short(path):
            self._pass_on(b"\n")

    @property
    def is_writing(self) -> bool:
        """Whether lines still go to the file."""
        return self._file is not None

    def write(self, text: str) -> None:
        """Add a line, or several that belong together; the last line end is added."""
        if self._file is None:
            return
        self._pass_on(f"{text}\n".encode())

    def _pass_on(self, data: bytes) -> None:
        rest = memoryview(data)
        try:
            while rest and self._file is not None:
                rest = rest[os.write(self._file, rest) :]
        except OSError as error:
            self.is_whole = False
            self._report(f"{self.path}: can be written no more: {error.strerror or error}")
            self.close()

    def close(self) -> None:
        """Write no more."""
        if self._file is not None:
            file, self._file = self._file, None
            try:
                os.close(file)
            except OSError as error:  # some file systems tell only now that the disk is full
                self.is_whole = False
                self._report(f"{self.path}: may be incomplete: {error.strerror or error}")


def _is_cut_short(path: Path) -> bool:
    """Whether the last line of a file has no end."""
    if not path.is_file():
        return False
    with open_to_read(path) as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(size - 1, 0))
        return file.read(1) not in (b"", b"\n")
