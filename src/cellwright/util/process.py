"""Start and end of processes: Ctrl-C during loading, threads left running, standard streams, and child processes.

A run continues without its reader: `cellwright run … | head -1` completes, with its log, its pictures and its exit
status. A closed terminal does not end a cell that is served.
"""

import atexit
import errno
import io
import json
import os
import select
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any, BinaryIO, ClassVar, TextIO

from cellwright._package import FOLDER

STOP_TIMEOUT = 2.0
"""Time that threads have to end when their process is done [s]."""

OUTPUT_LOST_STATUS = 1
"""Smallest exit status of a command whose output could not be written completely."""
_READER_GONE = {errno.EPIPE, errno.EIO} | ({errno.EINVAL} if sys.platform == "win32" else set())
"""Errors of a stream whose reader has ended, as with `| head -1`, or whose terminal was closed; not a failure."""
_WITHOUT_CHARACTER = "backslashreplace"
"""Characters that the stream's encoding lacks are escaped: a pipe on Windows lacks most, and file names may have odd
bytes. Python does so for stderr; on stdout it would raise an error in the middle of a line.
"""
_NAP = 0.01  # [s]
_NEW_PROCESS_GROUP: int = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)  # on Windows only
_READING = 5.0  # [s] to read the rest of a child's output
_TAIL = 2000  # bytes


@contextmanager
def silent_ctrl_c() -> Iterator[None]:
    """End the process silently at Ctrl-C, as most programs do; restore the handler afterwards.

    Loading takes half a second, in which Python would answer Ctrl-C with a traceback through its imports. A handler
    that the caller has set, or an ignored Ctrl-C, stays. So does the handler outside of the main thread, where none can
    be set.
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


def exit_despite_threads(before: Collection[threading.Thread], status: int) -> None:
    """End this process with `status`, and say so, if threads other than `before` still run after `STOP_TIMEOUT`."""
    own = {*before, threading.current_thread()}
    left = [thread for thread in threading.enumerate() if thread not in own and not thread.daemon]
    end = time.monotonic() + STOP_TIMEOUT
    for thread in left:
        thread.join(max(0.0, end - time.monotonic()))
    names = [thread.name for thread in left if thread.is_alive()]
    if names:
        with suppress(OSError, ValueError):  # stderr has been closed
            sys.stderr.write(f"threads left running, ended with the process: {', '.join(names)}\n")
        with suppress(Exception):
            atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()
        os._exit(status)


class TolerantStream(io.RawIOBase):
    """Stream that passes bytes on to a file, and drops them after the first failure."""

    def __init__(self, raw: io.RawIOBase) -> None:
        super().__init__()
        self._raw = raw
        self.failure: OSError | None = None
        """The error of the failed write, or None."""

    def write(self, data: Any, /) -> int:
        """Write as much as possible; return the number of bytes given."""
        rest = memoryview(data)
        count = rest.nbytes
        try:
            while rest and self.failure is None:
                taken = self._raw.write(rest)
                if taken is None:  # a full pipe in non-blocking mode
                    time.sleep(_NAP)
                else:
                    rest = rest[taken:]
        except OSError as error:
            self.failure = error
        return count

    def writable(self) -> bool:
        """Return True."""
        return True

    def fileno(self) -> int:
        """Return the file's descriptor."""
        return self._raw.fileno()

    def isatty(self) -> bool:
        """Return True if the file is a terminal."""
        return self._raw.isatty()

    @property
    def mode(self) -> str:
        """Mode of any file that is written to."""
        return "wb"

    @property
    def name(self) -> object:
        """Name of the file."""
        return getattr(self._raw, "name", "")


class StandardStreams:
    """Replacement of this process's stdout and stderr by tolerant streams, for as long as it lives."""

    def __init__(self) -> None:
        for name, flags in (("stdin", os.O_RDONLY), ("stdout", os.O_WRONLY), ("stderr", os.O_WRONLY)):
            if getattr(sys, name) is None:  # it was closed: the next file to be opened would take its number
                number = os.open(os.devnull, flags)
                setattr(sys, name, os.fdopen(number, "r" if name == "stdin" else "w", encoding="utf-8"))
        self._before: list[object] = []  # else they would be closed
        self._stdout = self._keep("stdout")
        self._keep("stderr")

    def status(self, status: int) -> int:
        """Flush the streams and return the exit status.

        Args:
            status: exit status of the command so far.

        Returns:
            `OUTPUT_LOST_STATUS` in place of 0 if output to stdout was lost, else `status`.
        """
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        failure = None if self._stdout is None else self._stdout.failure
        if failure is None or failure.errno in _READER_GONE:
            return status
        sys.stderr.write(f"error: stdout: cannot be written: {failure.strerror}\n")
        sys.stderr.flush()
        return status or OUTPUT_LOST_STATUS

    def _keep(self, name: str) -> TolerantStream | None:
        stream: IO[str] = getattr(sys, name)
        buffer = getattr(stream, "buffer", None)
        # With PYTHONUNBUFFERED there is no buffer.
        raw = getattr(buffer, "raw", buffer)
        if not isinstance(stream, io.TextIOWrapper):
            return None  # replaced by other code
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


def run_briefly(
    command: Sequence[str], environment: Mapping[str, str], timeout: float = 120.0
) -> subprocess.CompletedProcess[bytes] | None:
    """Run a program that asks about this machine; return None if it could not be started, or took too long.

    Args:
        command: program and arguments.
        environment: complete environment of the program.
        timeout: bound [s].
    """
    try:
        return subprocess.run(  # noqa: S603
            command,
            env=dict(environment),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=timeout,
            check=False,
            start_new_session=True,  # else a Ctrl-C on the terminal would make it fail
        )
    except (OSError, subprocess.TimeoutExpired):
        return None


def sourced_environment(setup: Path, environment: Mapping[str, str]) -> dict[str, str] | None:
    """Return the environment after bash has sourced a file; None if that is not possible."""
    ran = run_briefly(["/bin/bash", "-c", '. "$0" >/dev/null 2>&1; exec env -0', str(setup)], environment)
    if ran is None:
        return None
    pairs = (each.partition("=") for each in ran.stdout.decode(errors="replace").split("\0"))
    return {key: value for key, _, value in pairs if key}


def own_program(module: str, *arguments: str) -> list[str]:
    """Return the command that runs `main` of a Cellwright module, from the same installation as this process.

    With `-P`, no file in the current folder can shadow a module that the program needs.
    """
    code = f"import sys; sys.path.append(sys.argv[1]); from {module} import main; main()"
    return [sys.executable, "-P", "-c", code, str(Path(FOLDER).parent), *arguments]


def json_lines(stream: Iterable[bytes]) -> Iterator[Any]:
    """Yield the messages of another process, each a line of JSON, until its stream ends, if need be within a line."""
    # Half a line: it was killed while it wrote.
    with suppress(ValueError):
        for line in stream:
            yield json.loads(line)


def send_json(stream: TextIO, message: object) -> None:
    """Write a message as a line of JSON."""
    stream.write(json.dumps(message, allow_nan=False) + "\n")
    stream.flush()


def take_over_standard_streams() -> tuple[BinaryIO, TextIO]:
    """Return stdin and stdout for messages alone; all else reads nothing and writes to stderr from here on.

    A package that prints, or asks at the terminal, would damage the lines of JSON. Stdin has no buffer: a reader of
    one line leaves the rest.
    """
    lifeline = os.fdopen(os.dup(0), "rb", buffering=0)
    channel = os.fdopen(os.dup(1), "w", encoding="utf-8")
    empty = os.open(os.devnull, os.O_RDONLY)
    os.dup2(empty, 0)
    os.close(empty)
    os.dup2(2, 1)
    return lifeline, channel


class ChildProcess:
    """A program in a process of its own, with pipes to its stdin and from its stdout.

    The program must end when its stdin does, and so it ends with this process, in every case. A Ctrl-C on the terminal
    does not reach it: this process ends it in good order.

    Args:
        command: program and arguments.
        environment: complete environment of the program; None: that of this process.
        stderr: target of its stderr, as for `subprocess.Popen`. A file is closed in the end.
        read: reads its stdout to the end, in a separate thread; None: its stdout is not read.

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
                creationflags=_NEW_PROCESS_GROUP,
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
        """True if it has not ended yet."""
        return self._process.poll() is None

    def send(self, message: object) -> None:
        """Write a message to its stdin, a line of JSON; it is lost if the process has ended."""
        with suppress(OSError):
            self._stdin.write(f"{json.dumps(message)}\n".encode())
            self._stdin.flush()

    def ready_line(self, timeout: float | None = None) -> str:
        """Wait at most `timeout` [s] for the line that it prints when it is ready; empty if it ends, or is late."""
        try:
            if timeout is not None and not select.select([self._stdout], (), (), timeout)[0]:
                return ""
            return self._stdout.readline().decode(errors="replace").strip()
        except BaseException:  # a signal during its start
            self.end(0.0)
            raise

    def last_output(self) -> str:
        """Return the last line in the file of its stderr; empty if there is none."""
        try:
            assert self._log is not None
            self._log.seek(0)
            lines = self._log.read()[-_TAIL:].decode(errors="replace").split("\n")
        except (OSError, ValueError):
            return ""
        return next((line.strip() for line in reversed(lines) if line.strip()), "")

    def end(self, timeout: float) -> None:
        """Close its stdin so that it ends within `timeout` [s]; else kill it."""
        # The last output has found no reader.
        with suppress(OSError):
            self._stdin.close()
        if not self._ends_within(timeout):
            self._process.kill()
            self._process.wait()
        if self._reader is None:
            self._stdout.close()
        else:
            self._reader.join(_READING)
        if self._log is not None:
            self._log.close()

    def _ends_within(self, timeout: float) -> bool:
        try:
            self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            return False
        return True

    def _read_all(self, read: Callable[[IO[bytes]], None]) -> None:
        with self._stdout:
            read(self._stdout)
