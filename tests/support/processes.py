"""Processes that a test starts: their output, their end, and the processes that they leave behind."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import threading
import time
import uuid
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING

from tests.support.waiting import TIMEOUT, wait_until

if TYPE_CHECKING:
    from tests.support.warm import WarmProcess, WarmStart

FAMILY = "CELLWRIGHT_TEST_FAMILY"
"""Environment variable that a process passes to all its descendants, which identifies them even after its end."""


def restore_signals_in_children() -> None:
    """Give children the default handling of Ctrl-C and hang-up if the shell of the run ignores both.

    A child inherits that a signal is ignored. It does not inherit a handler, so this process handles both from now on,
    and does nothing.
    """
    for name in ("SIGINT", "SIGHUP"):
        number = getattr(signal, name, None)  # Windows has no SIGHUP
        if number is not None and signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, lambda *_: None)


class Process:
    """A process whose output is read as it comes."""

    def __init__(
        self, command: Sequence[str], environment: Mapping[str, str], folder: Path, *, warm: WarmStart | None = None
    ) -> None:
        """Start it, in a session of its own.

        Args:
            command: program and arguments.
            environment: all of its environment.
            folder: its working folder.
            warm: forks the program, a Python command; None to start the interpreter.
        """
        self.command = list(command)
        self.family = uuid.uuid4().hex
        environment = {**environment, FAMILY: self.family, "PYTHONUNBUFFERED": "1"}
        self._process: subprocess.Popen[str] | WarmProcess
        if warm is not None:
            self._process = warm.popen(self.command, folder=folder, environment=environment)
        else:
            self._process = _started(self.command, environment, folder)
        self._changed = threading.Condition()
        self._out: list[str] = []
        self._err: list[str] = []
        self._both: list[str] = []
        self._readers = [
            threading.Thread(target=self._read, args=args, daemon=True)
            for args in ((self._process.stdout, self._out), (self._process.stderr, self._err))
        ]
        for reader in self._readers:
            reader.start()

    @property
    def pid(self) -> int:
        return self._process.pid

    @property
    def out(self) -> str:
        """Its standard output so far."""
        with self._changed:
            return "".join(self._out)

    @property
    def err(self) -> str:
        """Its standard error so far."""
        with self._changed:
            return "".join(self._err)

    @property
    def said(self) -> str:
        """Its output on both streams so far, in the order in which it came."""
        with self._changed:
            return "".join(self._both)

    @property
    def running(self) -> bool:
        return self._process.poll() is None

    def wait_for(self, pattern: str, timeout: float = TIMEOUT, *, after: int = 0) -> re.Match[str]:
        """Wait for a pattern in its output, on either stream.

        Args:
            pattern: a regular expression, `^` and `$` stand for ends of lines.
            timeout: bound [s].
            after: number of earlier matches to skip.
        """
        search = re.compile(pattern, re.MULTILINE)
        end = time.monotonic() + timeout
        while True:
            with self._changed:
                found = list(search.finditer("".join(self._both)))
                if len(found) > after:
                    return found[after]
                left = end - time.monotonic()
                if left <= 0 or not (self.running or self._reading()):
                    raise AssertionError(self.tell(f"no {pattern!r} within {timeout:g} s"))
                self._changed.wait(min(left, 0.2))

    def signal(self, number: int) -> None:
        self._process.send_signal(number)

    def finish(self, timeout: float = TIMEOUT) -> int:
        """Wait for its end and the end of its output.

        Args:
            timeout: bound [s]; a process that takes longer is a failure.

        Returns:
            Its exit status.
        """
        try:
            status = self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            raise AssertionError(self.tell(f"still there after {timeout:g} s")) from None
        # a process that it has left behind may hold the pipes
        wait_until(lambda: not self._reading() or self.relatives(), "end of its output")
        for reader in self._readers:
            reader.join(0.5)
        return status

    def interrupt(self, timeout: float = TIMEOUT) -> int:
        """End it as Ctrl-C does; return its exit status."""
        if self.running:
            self.signal(signal.SIGINT)
        return self.finish(timeout)

    def kill(self) -> None:
        """Kill it, and all that it has started."""
        kill([self.pid] * self.running + self.relatives())
        self._process.wait()

    def relatives(self) -> list[int]:
        """Return its living descendants, without itself."""
        return [pid for pid in members(self.family) if pid != self.pid]

    def _read(self, stream: IO[str], lines: list[str]) -> None:
        for line in stream:
            with self._changed:
                lines.append(line)
                self._both.append(line)
                self._changed.notify_all()
        stream.close()

    def _reading(self) -> bool:
        return any(reader.is_alive() for reader in self._readers)

    def tell(self, what: str) -> str:
        """Return an error with its command and its output."""
        return f"{what}: {' '.join(self.command)}\n-- out --\n{self.out[-4000:]}\n-- err --\n{self.err[-4000:]}"


def _started(command: list[str], environment: Mapping[str, str], folder: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        command,
        env=environment,
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        start_new_session=True,
    )


def name_of(pid: int) -> str:
    """Return the command line of a process; empty if the process is gone."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace").strip()
    except OSError:
        return ""


def is_running(pid: int) -> bool:
    """Return whether a process runs; a zombie does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].split()[0] != b"Z"
    except OSError:
        return False


def members(family: str) -> list[int]:
    """Return the processes whose variable `FAMILY` has this value."""
    return [pid for pid, value in with_variable(FAMILY).items() if value == family]


def with_variable(name: str) -> dict[int, str]:
    """Return the running processes that were started with an environment variable, and its value in each."""
    start = f"{name}=".encode()
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            variables = (folder / "environ").read_bytes().split(b"\0")
        except OSError:  # it has ended meanwhile, or belongs to another user
            continue
        if value := next((each for each in variables if each.startswith(start)), b""):
            found[int(folder.name)] = value.removeprefix(start).decode(errors="replace")
    return found


def kill(pids: Iterable[int]) -> None:
    """Send SIGKILL to processes; those that have ended already are skipped."""
    for pid in pids:
        with suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
