"""Files that are written whole or not at all, and line files that keep all written lines.

Every line goes to the operating system immediately: SIGKILL loses at most the end of the current line.
"""

import errno
import json
import os
import stat
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from io import BufferedReader
from itertools import count
from pathlib import Path
from typing import Any, BinaryIO, Self

from cellwright.util.errors import UsageError

LFS_POINTER = "a Git LFS pointer, not the file itself; fetch the file with: git lfs pull"
"""Text for a file for which `is_lfs_pointer` is true."""

_BYTES_AS_THEY_ARE: int = getattr(os, "O_BINARY", 0)  # without it Windows would write two characters for a line end
_numbers = count()


def open_to_read(path: Path) -> BufferedReader:
    """Open a file to read it; a named pipe is refused, because opening one waits for a writer.

    A shell passes `/dev/stdin` or `<(command)` as a pipe without a name, which is accepted.

    Raises:
        OSError: it cannot be read, or is a named pipe.
        ValueError: no file can have this name.
    """
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | _BYTES_AS_THEY_ARE)
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


def is_lfs_pointer(content: bytes) -> bool:
    """Return whether the content of a file is what Git keeps in its place until Git LFS fetches it."""
    return content.startswith(b"version https://git-lfs.github.com/spec/")


def open_below(folder: Path, name: str | Path) -> BinaryIO:
    """Open a plain file below a folder in which programs of others write, such as that of an evaluation.

    Links below the folder are refused: they could lead to any file of the user. So are pipes and devices.

    Raises:
        OSError: it cannot be read, or is no plain file.
        ValueError: no file can have this name.
    """
    path = folder / name
    inside = [place for place in (path, *path.parents) if place != folder and place.is_relative_to(folder)]
    if any(os.path.islink(place) for place in inside):
        raise OSError(errno.ELOOP, "it is a link, not a regular file", str(path))
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOFOLLOW", 0) | _BYTES_AS_THEY_ARE
    descriptor = os.open(path, flags)
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise OSError(errno.EINVAL, "not a regular file", str(path))
        return os.fdopen(descriptor, "rb")
    except BaseException:
        with suppress(OSError):
            os.close(descriptor)
        raise


def open_descriptor(path: Path, flags: int) -> int:
    """Open a file to write it, and return its descriptor; a named pipe that no program reads is refused.

    Raises:
        OSError: it cannot be written.
    """
    try:
        descriptor = os.open(path, flags | getattr(os, "O_NONBLOCK", 0) | _BYTES_AS_THEY_ARE, 0o666)
    except OSError as error:
        if error.errno != errno.ENXIO:
            raise
        raise OSError(errno.ENXIO, "it is a named pipe that no program reads", str(path)) from None
    if hasattr(os, "O_NONBLOCK"):
        os.set_blocking(descriptor, True)
    return descriptor


@contextmanager
def atomic_file(path: Path) -> Iterator[BinaryIO]:
    """Open a file to write to, which replaces `path` once all is written.

    A device or a pipe cannot be replaced, nor a file in a folder that does not accept new files: these are written to
    directly. A link stays, and its target is written.

    Raises:
        OSError: it cannot be written; the previous contents are unchanged.
    """
    target = Path(os.path.realpath(path))
    temporary = target.with_name(f".{os.getpid()}-{next(_numbers)}.part")
    is_there = os.path.lexists(target)
    if is_there and not target.is_file():
        with os.fdopen(open_descriptor(path, os.O_WRONLY), "wb") as file:
            yield file
        return
    if is_there:
        # A file without write permission is not replaced either.
        path.open("ab").close()
    try:
        file = temporary.open("xb")
    except OSError:
        if not is_there:
            # The error then names the given path, not the temporary one.
            path.open("xb").close()
            path.unlink()
            raise
        with path.open("wb") as file:
            yield file
        return
    try:
        with file:
            yield file
        if is_there:
            # Some file systems have no permissions.
            with suppress(OSError):
                temporary.chmod(target.stat().st_mode)
        temporary.replace(target)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


@contextmanager
def replacement_path(path: Path) -> Iterator[Path]:
    """Yield a path for a writer that opens its file itself; in the end that file replaces `path`.

    Raises:
        OSError: the file cannot be moved there; the previous contents are unchanged.
    """
    unfinished = path.with_name(f".{os.getpid()}-{next(_numbers)}-{path.name}.part")
    try:
        yield unfinished
        os.replace(unfinished, path)
    finally:
        with suppress(OSError):
            unfinished.unlink()


def write_atomic(path: Path, content: str | bytes) -> None:
    """Write a file, whole or not at all; see `atomic_file`. Text is written as UTF-8, with its line ends unchanged.

    Raises:
        OSError: it cannot be written.
    """
    with atomic_file(path) as file:
        file.write(content.encode() if isinstance(content, str) else content)


def user_folder(variable: str, default: str, variables: Mapping[str, str] = os.environ) -> Path:
    """Return Cellwright's folder below a base folder of the user, such as `~/.cache/cellwright`.

    Args:
        variable: name of the variable with the base folder ("XDG_CACHE_HOME"); a relative path in it is ignored.
        default: the base folder without it, below the home folder (".cache").
        variables: the environment.
    """
    base = variables.get(variable, "")
    return (Path(base) if os.path.isabs(base) else Path.home() / default) / "cellwright"


def update_file(path: Path, content: bytes) -> None:
    """Write a file of a package unless it is up to date; another file in its place is kept with a tilde.

    A file with a shebang is made executable.

    Raises:
        OSError: it cannot be written.
    """
    mode = 0o755 if content.startswith(b"#!") else 0o644
    if path.is_file():
        if path.read_bytes() == content:
            path.chmod(mode)
            return
        path.replace(path.with_name(f"{path.name}~"))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    path.chmod(mode)


class LineFile:
    """File of lines.

    A failing disk does not stop the program. The first line that cannot be written is reported, and nothing is written
    from then on, so that the file has no gap.

    Args:
        path: the file.
        append: append to the file, also after a last line that was cut short; else replace it.
        report: takes a line about a file that can no longer be written.

    Raises:
        OSError: the file cannot be opened.
    """

    def __init__(self, path: Path, *, append: bool = False, report: Callable[[str], None] = lambda _line: None) -> None:
        self.path = path
        self.is_whole = True
        """True if all lines so far have gone to the file."""
        self._report = report
        flags = os.O_WRONLY | os.O_CREAT | (os.O_APPEND if append else os.O_TRUNC)
        self._file: int | None = open_descriptor(path, flags)
        if append and _is_cut_short(path):
            self._write_all(b"\n")

    @property
    def is_writing(self) -> bool:
        """True if lines still go to the file."""
        return self._file is not None

    def write(self, text: str) -> None:
        """Add a line, or several that belong together; the last line end is added."""
        if self._file is None:
            return
        self._write_all(f"{text}\n".encode())

    def _write_all(self, data: bytes) -> None:
        rest = memoryview(data)
        try:
            while rest and self._file is not None:
                rest = rest[os.write(self._file, rest) :]
        except OSError as error:
            self.is_whole = False
            self._report(f"{self.path}: cannot be written any more: {error.strerror or error}")
            self.close()

    def close(self) -> None:
        """Close the file; later lines are dropped."""
        if self._file is not None:
            file, self._file = self._file, None
            try:
                os.close(file)
            except OSError as error:  # some file systems report a full disk only now
                self.is_whole = False
                self._report(f"{self.path}: may be incomplete: {error.strerror or error}")


def _is_cut_short(path: Path) -> bool:
    """Return True if the last line of a file has no end."""
    if not path.is_file():
        return False
    with open_to_read(path) as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(size - 1, 0))
        return file.read(1) not in (b"", b"\n")


class JsonLines(LineFile):
    """File of JSON lines.

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
            ValueError: the value has a number outside of JSON, or something that is no JSON value.
        """
        if self.is_writing:
            self.write(json.dumps(value, allow_nan=False))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def read_json_lines(path: Path) -> list[dict[str, Any]]:
    """Return the values in a file of JSON lines, without lines that were cut short.

    Raises:
        UsageError: the file cannot be read.
    """
    try:
        with open_to_read(path) as file:
            lines = file.read().split(b"\n")
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
