"""Program in a process of its own that leaves no process behind, however it ends."""

import os
import secrets
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO

from cellwright.middleware.wire import guard
from cellwright.util.process import ChildProcess

MARK = "CELLWRIGHT_GUARDED"
"""Variable that all descendants of a guarded program have, unless they clear their environment."""

_SWEEPS = 50
"""Looks for processes of a program that has killed its guard; each kills what it finds."""


class GuardedProcess(ChildProcess):
    """A program with all that it starts, detached or not; on Linux a guard ends them (`middleware/wire/guard.py`).

    Elsewhere the program has to end with its stdin or its connection, and what it has started is not followed.

    Args:
        command: program and arguments.
        folder: folder that is removed if this process is killed; empty for none.
        relays: the program reads what `send` writes; else its stdin is empty.
        environment: complete environment of the program.
        stderr: as for `ChildProcess`.
        read: as for `ChildProcess`.

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
    ) -> None:
        self._is_guarded = sys.platform == "linux"
        self._mark = secrets.token_hex(8)
        if self._is_guarded:
            stdin = guard.RELAYED if relays else guard.EMPTY
            command = [sys.executable, "-I", "-S", guard.__file__, stdin, folder, *command]
        # A guarded program may guard another one.
        marks = f"{environment.get(MARK, '')} {self._mark}".strip()
        super().__init__(command, environment={**environment, MARK: marks}, stderr=stderr, read=read)

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
