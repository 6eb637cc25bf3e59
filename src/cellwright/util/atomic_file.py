"""Files that are written whole or stay as they were before, and files that are read without waiting for a writer.

What fails half-way, or is killed, leaves no half file behind.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import BinaryIO

_numbers = count()


def open_to_read(path: Path) -> BinaryIO:
    """Open a file to read it. A named pipe is refused, since opening one waits for somebody who writes into it.

    What a shell passes on as `/dev/stdin` or `<(command)` is a pipe without a name, and read.

    Raises:
        OSError: it cannot be read, or is a named pipe.
        ValueError: it has a name that no file can have.
    """
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        if stat.S_ISFIFO(os.fstat(descriptor).st_mode):
            if os.path.lexists(os.path.realpath(path)):
                raise OSError(errno.EINVAL, "it is a named pipe, not a file", str(path))
            os.set_blocking(descriptor, True)
        return os.fdopen(descriptor, "rb")
    except BaseException:
        with suppress(OSError):
            os.close(descriptor)
        raise


@contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """A file to write to, which takes the place of `path` once all is written.

    Nothing else can take the place of a device or a pipe, nor of a file in a folder where none can be made: such a one
    is written to as it stands. A link stays, and what it leads to is written.

    Raises:
        OSError: it cannot be written; what was there before is there still.
    """
    target = Path(os.path.realpath(path))
    temporary = target.with_name(f".{os.getpid()}-{next(_numbers)}.part")
    is_there = os.path.lexists(target)
    if is_there and not target.is_file():
        with path.open("wb") as file:
            yield file
        return
    if is_there:
        path.open("ab").close()  # one that must not be written is not replaced either
    try:
        file = temporary.open("xb")
    except OSError:
        if not is_there:
            _tell_of(path)
            raise
        with path.open("wb") as file:
            yield file
        return
    try:
        with file:
            yield file
        if is_there:
            with suppress(OSError):  # some file systems know no rights
                temporary.chmod(target.stat().st_mode)
        temporary.replace(target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


@contextmanager
def in_its_place(path: Path) -> Iterator[Path]:
    """A path for a writer that opens its file itself; what it has written takes the place of `path` in the end.

    Raises:
        OSError: it cannot be put there; what was there before is there still.
    """
    unfinished = path.with_name(f".{os.getpid()}-{next(_numbers)}-{path.name}.part")
    try:
        yield unfinished
        os.replace(unfinished, path)
    finally:
        with suppress(OSError):
            unfinished.unlink()


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file, whole or not at all; see `whole_file`. Text is written as UTF-8, its line ends as they are.

    Raises:
        OSError: it cannot be written.
    """
    with whole_file(path) as file:
        file.write(content.encode() if isinstance(content, str) else content)


def _tell_of(path: Path) -> None:
    """Fail as opening `path` itself fails, where it does: for the name that somebody gave, and not for another."""
    path.open("xb").close()
    path.unlink()
