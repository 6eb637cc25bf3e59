"""Start and end of processes: Ctrl-C while one loads, threads left running, standard streams, and child processes.

A run of ten minutes is worth more than what listens to it: `cellwright run … | head -1` goes to its end, with its log,
its pictures and its exit status, though nobody reads on. A terminal that was closed ends no cell that is served.
"""

import atexit
import errno
import io
import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any, ClassVar

from cellwright._package import FOLDER

PATIENCE = 2.0
"""How long threads may take to end when their process is done [s]."""


@contextmanager
def interrupts_end_the_process() -> Iterator[None]:
    """Let a Ctrl-C end the process as it does for most programs, with nothing said; afterwards it is as it was.

    Loading takes half a second, in which Python would show whoever presses Ctrl-C a traceback through its imports.
    Where a caller has set a handler of its own, or has Ctrl-C ignored, that stands; and so it does in a thread of its
    own, where none can be set.
    """
    is_main = threading.current_thread() is threading.main_thread()
    is_usual = is_main and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if is_usual:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        if is_usual:
            signal.signal(signal.SIGINT, signal.default_int_handler)


def end_despite_threads(before: Collection[threading.Thread], status: int) -> None:
    """End this process with a status if other threads than those `before` go on after `PATIENCE`, and say so."""
    own = {*before, threading.current_thread()}
    left = [thread for thread in threading.enumerate() if thread not in own and not thread.daemon]
    end = time.monotonic() + PATIENCE
    for thread in left:
        thread.join(max(0.0, end - time.monotonic()))
    names = [thread.name for thread in left if thread.is_alive()]
    if names:
        with suppress(OSError, ValueError):  # who listens has gone
            sys.stderr.write(f"left running, and ended with the process: {', '.join(names)}\n")
        with suppress(Exception):
            atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()
        os._exit(status)


NOT_SAID = 1
"""Least exit status of a command that could not say all that it had to say."""

_NOBODY_LISTENS = {errno.EPIPE, errno.EIO} | ({errno.EINVAL} if sys.platform == "win32" else set())
"""Who read has gone, as with `| head -1`, or the terminal was closed: that is the reader's wish, and no failure."""

_WITHOUT_CHARACTER = "backslashreplace"
"""What a stream has no character for is written as its number: a pipe on Windows lacks most, and names of files may be
of odd bytes. Python does so for stderr; on stdout it would be an error in the middle of a line."""

_NAP = 0.01  # [s]


class TolerantStream(io.RawIOBase):
    """Passes bytes on to a file, until that takes no more; then they go nowhere."""

    def __init__(self, raw: io.RawIOBase) -> None:
        super().__init__()
        self._raw = raw
        self.failure: OSError | None = None
        """Why it takes no more."""

    def write(self, data: Any, /) -> int:
        """Pass on what can be passed on."""
        rest = memoryview(data)
        count = rest.nbytes
        try:
            while rest and self.failure is None:
                taken = self._raw.write(rest)
                if taken is None:  # a pipe that is full, and that somebody has told not to wait
                    time.sleep(_NAP)
                else:
                    rest = rest[taken:]
        except OSError as error:
            self.failure = error
        return count

    def writable(self) -> bool:
        """It is."""
        return True

    def fileno(self) -> int:
        """The file's number."""
        return self._raw.fileno()

    def isatty(self) -> bool:
        """Whether a terminal shows it."""
        return self._raw.isatty()

    @property
    def mode(self) -> str:
        """As of any file that is written to."""
        return "wb"

    @property
    def name(self) -> object:
        """The file's."""
        return getattr(self._raw, "name", "")


class StandardStreams:
    """Takes stdout and stderr of this process into its keeping, for as long as it lives."""

    def __init__(self) -> None:
        for name, flags in (("stdin", os.O_RDONLY), ("stdout", os.O_WRONLY), ("stderr", os.O_WRONLY)):
            if getattr(sys, name) is None:  # it was closed: the next file to be opened would take its number
                number = os.open(os.devnull, flags)
                setattr(sys, name, os.fdopen(number, "r" if name == "stdin" else "w", encoding="utf-8"))
        self._before: list[object] = []  # else they would be closed
        self._stdout = self._keep("stdout")
        self._keep("stderr")

    def status(self, status: int) -> int:
        """Say the last; the exit status, which is `NOT_SAID` in place of 0 where stdout did not take all."""
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        failure = None if self._stdout is None else self._stdout.failure
        if failure is None or failure.errno in _NOBODY_LISTENS:
            return status
        sys.stderr.write(f"error: stdout: cannot be written: {failure.strerror}\n")
        sys.stderr.flush()
        return status or NOT_SAID

    def _keep(self, name: str) -> TolerantStream | None:
        stream: IO[str] = getattr(sys, name)
        buffer = getattr(stream, "buffer", None)
        raw = getattr(buffer, "raw", buffer)  # with PYTHONUNBUFFERED there is nothing between
        if not isinstance(stream, io.TextIOWrapper):
            return None  # somebody else's
        if not isinstance(raw, io.RawIOBase):
            stream.reconfigure(errors=_WITHOUT_CHARACTER)
            return None
        self._before.append(stream)
        outlet = TolerantStream(raw)
        kept = io.TextIOWrapper(
            io.BufferedWriter(outlet),
            encoding=stream.encoding,
            errors=_WITHOUT_CHARACTER,
            line_buffering=stream.line_buffering or name == "stderr",
            write_through=stream.write_through,
        )
        setattr(sys, name, kept)
        return outlet


_APART: int = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)  # on Windows alone
_READING = 5.0  # [s] that the rest of what a child has written may take to be read
_TAIL = 2000  # bytes


def own_program(module: str, *arguments: str) -> list[str]:
    """The command that runs `main` of a module of Cellwright, wherever this process has Cellwright from.

    With `-P`, no file that lies where the command is called can stand in for a module that the program needs.
    """
    code = f"import sys; sys.path.append(sys.argv[1]); from {module} import main; main()"
    return [sys.executable, "-P", "-c", code, str(Path(FOLDER).parent), *arguments]


class ChildProcess:
    """A program in a process of its own, with pipes to its stdin and from its stdout.

    It is to end when its stdin does, and so with this process, however that ends. A Ctrl-C on the terminal is not for
    it: this process ends it in good order.

    Args:
        command: program and arguments.
        environment: of the program, whole; None: that of this process.
        stderr: where it writes errors to, as for `subprocess.Popen`. A file is closed in the end.
        read: reads its stdout to the end, in a thread of its own; None: nobody does.

    Raises:
        OSError: it cannot be started.
    """

    _popen: ClassVar[Callable[..., subprocess.Popen[bytes]]] = subprocess.Popen

    def __init__(
        self,
        command: Sequence[str],
        *,
        environment: Mapping[str, str] | None = None,
        stderr: IO[bytes] | int | None = None,
        read: Callable[[IO[bytes]], None] | None = None,
    ) -> None:
        self._log = None if stderr is None or isinstance(stderr, int) else stderr
        try:
            self._process = self._popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=stderr,
                env=None if environment is None else dict(environment),
                start_new_session=os.name == "posix",
                creationflags=_APART,
            )
        except OSError:
            if self._log is not None:
                self._log.close()
            raise
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._stdin, self._stdout = self._process.stdin, self._process.stdout
        self._reader: threading.Thread | None = None
        if read is not None:
            self._reader = threading.Thread(target=self._read_all, args=(read,), daemon=True)
            self._reader.start()

    @property
    def is_running(self) -> bool:
        """Whether it has not ended yet."""
        return self._process.poll() is None

    def send(self, line: str) -> None:
        """Write a line to its stdin; it is lost where the process has ended."""
        with suppress(OSError):
            self._stdin.write(f"{line}\n".encode())
            self._stdin.flush()

    def ready_line(self, timeout: float | None = None) -> str:
        """Wait for the line that it says when it is ready, at most so long [s]; empty if it ends, or is late."""
        try:
            if timeout is not None and not select.select([self._stdout], (), (), timeout)[0]:
                return ""
            return self._stdout.readline().decode(errors="replace").strip()
        except BaseException:  # a signal, while it starts
            self.end(0.0)
            raise

    def last_words(self) -> str:
        """The last line in the file that its stderr goes to; empty if there is none."""
        try:
            assert self._log is not None
            self._log.seek(0)
            lines = self._log.read()[-_TAIL:].decode(errors="replace").split("\n")
        except (OSError, ValueError):
            return ""
        return next((line.strip() for line in reversed(lines) if line.strip()), "")

    def end(self, patience: float) -> None:
        """Have it end by the end of its stdin, within so long [s]; else kill it."""
        with suppress(OSError):  # what was written last has found no reader
            self._stdin.close()
        if not self._ends_within(patience):
            self._process.kill()
            self._process.wait()
        if self._reader is None:
            self._stdout.close()
        else:
            self._reader.join(_READING)
        if self._log is not None:
            self._log.close()

    def _ends_within(self, patience: float) -> bool:
        try:
            self._process.wait(patience)
        except subprocess.TimeoutExpired:
            return False
        return True

    def _read_all(self, read: Callable[[IO[bytes]], None]) -> None:
        with self._stdout:
            read(self._stdout)
