"""Files that are written whole or not at all, and files of lines that keep what was written whatever happens.

Every line is handed to the operating system at once: SIGKILL takes away at most the end of the one being written.
"""

import errno
import json
import os
import stat
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import Any, BinaryIO, Self

from cellwright.util.errors import UsageError

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
def atomic_file(path: Path) -> Iterator[BinaryIO]:
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
            path.open("xb").close()  # it fails for the name that somebody gave, and not for another
            path.unlink()
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
    """Write a file, whole or not at all; see `atomic_file`. Text is written as UTF-8, its line ends as they are.

    Raises:
        OSError: it cannot be written.
    """
    with atomic_file(path) as file:
        file.write(content.encode() if isinstance(content, str) else content)


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


class JsonLines(LineFile):
    """Writes a file of JSON lines.

    Raises:
        UsageError: the file cannot be opened.
    """

    def __init__(self, path: Path, *, append: bool = False, report: Callable[[str], None] = lambda _line: None) -> None:
        try:
            super().__init__(path, append=append, report=report)
        except OSError as error:
            raise UsageError(f"{path}: cannot be written: {error.strerror or error}") from None

    def write_value(self, value: Mapping[str, Any]) -> None:
        """Add a line.

        Raises:
            ValueError: the value holds a number that JSON has not, or something that is no JSON value.
        """
        if self.is_writing:
            self.write(json.dumps(value, allow_nan=False))

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
