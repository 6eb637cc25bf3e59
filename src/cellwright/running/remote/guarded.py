"""Program in a process of its own that leaves no process behind, however it ends."""

import ctypes
import os
import secrets
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import IO

from cellwright.middleware.wire import guard
from cellwright.running.remote.fork_server import ForkServer
from cellwright.util.process import ChildProcess

MARK = "CELLWRIGHT_GUARDED"
"""Variable that all descendants of a guarded program have, unless they clear their environment."""

_MARK_BYTES = 8
_ENVIRONMENT = slice(47, 49)
"""Places in the file `stat` of a process, behind its name: addresses of begin and end of what its `environ` shows."""
_SWEEPS = 50
"""Looks for processes of a program that has killed its guard; each kills what it finds."""


class GuardedProcess(ChildProcess):
    """A program with all that it starts, detached or not; on Linux a guard ends them (`middleware/wire/guard.py`).

    Elsewhere the program has to end with its stdin or its connection, and what it has started is not followed.

    Args:
        command: program and arguments; with a server, as for `ForkServer.popen`.
        folder: folder that is removed if this process is killed; empty for none.
        relays: the program reads what `send` writes; else its stdin is empty.
        environment: complete environment of the program.
        stderr: as for `ChildProcess`.
        read: as for `ChildProcess`.
        server: the server that forks for it, from `guarding_server`; None to start it.

    Raises:
        OSError: it cannot be started.
    """

    def __init__(
        self,
        command: Sequence[str],
        *,
        folder: str = "",
        relays: bool = False,
        environment: Mapping[str, str],
        stderr: IO[bytes] | int,
        read: Callable[[IO[bytes]], None],
        server: ForkServer | None = None,
    ) -> None:
        self._is_guarded = sys.platform == "linux"
        self._mark = secrets.token_hex(_MARK_BYTES)
        words = [guard.RELAYED if relays else guard.EMPTY, folder, *command]
        if server is not None:
            # what it returns has the part of `subprocess.Popen` that is used
            self._popen = server.popen  # type: ignore[misc, assignment]
            command = [__name__, *words]
        elif self._is_guarded:
            command = [sys.executable, "-I", "-S", guard.__file__, *words]
        super().__init__(command, environment=_marked(environment, self._mark), stderr=stderr, read=read)

    @property
    def is_running(self) -> bool:
        """True if it has not ended yet."""
        self._resume_guard()
        return super().is_running

    def end(self, timeout: float) -> None:
        """End it and all that it has started, within `timeout` [s] if the guard can; else kill them from here."""
        if self._is_guarded:
            self._resume_guard()
            with suppress(OSError):
                self._stdin.close()
            if not self._ends_within(timeout):
                guard.kill_descendants(self._process.pid)
                self._process.kill()
                self._process.wait()
            # The program may have killed its guard.
            if self._process.returncode == -signal.SIGKILL:
                _kill_marked(self._mark.encode())
        super().end(timeout)

    def _resume_guard(self) -> None:
        """Let the guard go on, which the program may have stopped: it would not see the end of the program."""
        if self._is_guarded:
            with suppress(ProcessLookupError):
                self._process.send_signal(signal.SIGCONT)


def guarding_server(modules: Sequence[str], environment: Mapping[str, str]) -> ForkServer:
    """Return a new fork server for guarded programs; arguments as for `ForkServer`."""
    return ForkServer([__name__, *modules], _marked(environment, "0" * 2 * _MARK_BYTES))


def main() -> None:
    """Guard `main` of a module, in a fork: `STDIN FOLDER MODULE ARGUMENT…`, the first two as for `guard.py`."""
    stdin, folder, module, *sys.argv[2:] = sys.argv[2:]
    _show_mark(os.environ[MARK])

    def begin() -> None:
        signal.signal(signal.SIGINT, signal.default_int_handler)
        import_module(module).main()

    guard.watch(stdin, folder, begin)


def _marked(environment: Mapping[str, str], mark: str) -> dict[str, str]:
    """Return an environment with a mark more: a guarded program may guard another one."""
    return {**environment, MARK: f"{environment.get(MARK, '')} {mark}".strip()}


def _show_mark(marks: str) -> None:
    """Show marks in `environ` of this process and its forks, which is the memory of the fork server's environment."""
    fields = Path("/proc/self/stat").read_bytes().rpartition(b")")[2].split()
    begin, end = map(int, fields[_ENVIRONMENT])
    name = f"{MARK}=".encode()
    place = begin + ctypes.string_at(begin, end - begin).index(name) + len(name)
    assert len(ctypes.string_at(place)) == len(marks)
    ctypes.memmove(place, marks.encode(), len(marks))


def _kill_marked(mark: bytes) -> None:
    """Kill the processes that have a mark in their environment, until there is none."""
    for _ in range(_SWEEPS):
        marked = [int(entry.name) for entry in Path("/proc").iterdir() if entry.name.isdigit() and _has(entry, mark)]
        if not marked:
            return
        for number in marked:
            with suppress(OSError):
                os.kill(number, signal.SIGKILL)


def _has(process: Path, mark: bytes) -> bool:
    try:
        return mark in (process / "environ").read_bytes()
    except OSError:  # it has ended, or is another user's
        return False
