"""Render process: its command, and messages through the pipes to and from it."""

import pickle
from collections.abc import Iterable
from typing import IO, Any

from cellwright.util.process import own_program


def command(backends: Iterable[str] = ()) -> list[str]:
    """Return the command of a render process.

    Args:
        backends: those to try, in order; none: that of the environment, or all of the system.
    """
    return own_program("cellwright.rendering.worker.program", *backends)


def write(pipe: IO[bytes], message: object) -> None:
    """Send a message. Both ends are our own programs, so it may be any object.

    Raises:
        OSError: the reader is gone.
    """
    pickle.dump(message, pipe, pickle.HIGHEST_PROTOCOL)
    pipe.flush()


def read(pipe: IO[bytes]) -> Any:
    """Return the next message; None at the end, also within a message."""
    try:
        return pickle.load(pipe)  # noqa: S301 (from a program of ours)
    except (EOFError, pickle.UnpicklingError):
        return None
