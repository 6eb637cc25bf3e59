"""Render process: its command, and messages through the pipes to and from it."""

import pickle
from collections.abc import Iterable
from typing import IO, Any

from cellwright.util.process import own_program


def command(ways: Iterable[str] = ()) -> list[str]:
    """The command of a process that draws.

    Args:
        ways: those that it tries, in order; none: as is settled, or all that there are.
    """
    return own_program("cellwright.rendering.worker.program", *ways)


def write(pipe: IO[bytes], message: object) -> None:
    """Send a message; both ends are programs of ours, so it may be any object.

    Raises:
        OSError: nobody reads it any more.
    """
    pickle.dump(message, pipe, pickle.HIGHEST_PROTOCOL)
    pipe.flush()


def read(pipe: IO[bytes]) -> Any:
    """A message; None at the end, also at one within a message."""
    try:
        return pickle.load(pipe)  # noqa: S301 (from a program of ours)
    except (EOFError, pickle.UnpicklingError):
        return None
