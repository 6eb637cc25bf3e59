"""Render process: its command, and messages through the pipes to and from it."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any, BinaryIO

from cellwright._package import FOLDER

_PROGRAM = "import sys; sys.path.append(sys.argv[1]); from cellwright.rendering.worker.program import main; main()"


def command(ways: Iterable[str] = ()) -> list[str]:
    """The command of a process that draws.

    Args:
        ways: those that it tries, in order; none: as is settled, or all that there are.
    """
    return [sys.executable, "-P", "-c", _PROGRAM, str(Path(FOLDER).parent), *ways]


def write(pipe: BinaryIO, message: object) -> None:
    """Send a message; both ends are programs of ours, so it may be any object.

    Raises:
        OSError: nobody reads it any more.
    """
    pickle.dump(message, pipe, pickle.HIGHEST_PROTOCOL)
    pipe.flush()


def read(pipe: BinaryIO) -> Any:
    """A message; None at the end, also at one within a message."""
    try:
        return pickle.load(pipe)  # noqa: S301 (from a program of ours)
    except (EOFError, pickle.UnpicklingError):
        return None
