"""Lines for people; the cell's process passes them on."""

from __future__ import annotations

import contextlib
import sys
from typing import TextIO


def report(line: str) -> None:
    """Say something in one line, on stderr."""
    _write(sys.stderr, line)


def say_ready(more: str = "") -> None:
    """Say that all is there: the one line on stdout."""
    _write(sys.stdout, f"ready {more}".rstrip())


def _write(stream: TextIO, line: str) -> None:
    """Write a line. When nobody can hear it any more, that is no error."""
    with contextlib.suppress(OSError, ValueError):
        stream.write(line.replace("\n", " ") + "\n")
        stream.flush()
