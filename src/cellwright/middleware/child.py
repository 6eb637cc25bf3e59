"""Child processes: tied to this process, read without blocking, restarted with a back-off.

One thread calls everything here: it starts the children and lives as long as the process, since a child is tied to the
thread that starts it. No call waits longer than documented.

A program of Cellwright ends with its stdin, and is a `ChildProcess` of `util/process.py`. Programs of ROS do not: the
kernel ends them with this process, and their lines come to the one thread that serves.
"""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from cellwright.middleware import wire as link

_PARENT_WATCH = Path(link.__file__).with_name("parent_watch.py")
_PIECE = 1 << 16
_MAX_LINE_LENGTH = 1 << 14
_NAP = 0.01  # [s]

KILL: signal.Signals = getattr(signal, "SIGKILL", signal.SIGTERM)  # Windows has no SIGKILL

STOPPING: tuple[tuple[signal.Signals, float], ...] = ((signal.SIGTERM, 10.0), (KILL, 1.0))
"""Signals that end a child, and the time [s] that each leaves it.

A bridge needs 0.3 s of processor time to leave its graph, which are seconds on a busy machine. Killed before, one of
ROS 2 would leave 16 MiB of shared memory for good.
"""

READY_LIMIT = 300.0
"""Time [s] for a program that lives to be ready: a busy machine may take ten times as long as an idle one."""
READY_PERIOD = 20.0  # time [s] between two lines about one that is not ready yet
_FIRST_WAIT, _MAX_WAIT = 0.25, 8.0  # [s]
_FORGIVEN = 10.0  # [s]: after a run this long, the next failure counts as the first


class Lines:
    """Reader of lines from a pipe without blocking."""

    def __init__(self, pipe: int, take: Callable[[str], None]) -> None:
        os.set_blocking(pipe, False)
        self._pipe = pipe
        self._take = take
        self._rest = b""

    def read(self) -> bool:
        """Read at most one piece, so that much output does not block the rest; return whether there was any."""
        try:
            data = os.read(self._pipe, _PIECE)
        except OSError:
            return False
        *lines, rest = (self._rest + data).split(b"\n")
        self._rest = rest[:_MAX_LINE_LENGTH]
        for line in lines:
            text = line.decode(errors="replace").rstrip()
            if text:
                self._take(text)
        return bool(data)


class Child:
    """Child process in its own session: a Ctrl-C on the terminal goes to its parent only.

    It starts through `python` with the whole `environment`, and gets the signal `parting` when this process is gone.
    The lines of its stderr go to `on_error`, those of its stdout to `on_output` or nowhere.

    Raises:
        OSError: it cannot be started.
    """

    def __init__(
        self,
        command: Sequence[str],
        environment: Mapping[str, str],
        *,
        python: str,
        parting: signal.Signals = KILL,
        on_output: Callable[[str], None] | None = None,
        on_error: Callable[[str], None] = lambda _line: None,
    ) -> None:
        tied = [python, "-I", "-S", str(_PARENT_WATCH), str(os.getpid()), str(int(parting)), *command]
        self.started = time.monotonic()  # time of its start [s] of `time.monotonic`
        self._process = subprocess.Popen(  # noqa: S603
            tied,
            env=dict(environment),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL if on_output is None else subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
        self._pipes = [
            Lines(stream.fileno(), take)
            for stream, take in ((self._process.stdout, on_output), (self._process.stderr, on_error))
            if stream is not None and take is not None
        ]

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def poll(self) -> int | None:
        """Forward its output; return its exit status, minus the signal that ended it, or None while it runs."""
        status = self._process.poll()
        for pipe in self._pipes:
            while pipe.read() and status is not None:  # once it has ended: all remaining output
                pass
        return status

    def stop(self, stopping: Sequence[tuple[signal.Signals, float]] = STOPPING) -> None:
        """End it by each signal of `stopping` in turn, with the time for it, and forward its output until then."""
        for number, timeout in stopping:
            if self.poll() is not None:
                break
            self._process.send_signal(number)
            end = time.monotonic() + timeout
            while self.poll() is None and time.monotonic() < end:
                time.sleep(_NAP)
        for stream in (self._process.stdout, self._process.stderr):
            if stream is not None:
                stream.close()
        self._pipes.clear()


class Waiting:
    """Wait for a program that has been started: says at times that it goes on, and ends after `READY_LIMIT`.

    Args:
        what: its name in a sentence.
        report: takes a line.
    """

    def __init__(self, what: str, report: Callable[[str], None]) -> None:
        self._what, self._report = what, report
        self._began = time.monotonic()
        self._next = READY_PERIOD

    def is_over(self) -> bool:
        """Return whether the limit is reached; call it often."""
        waited = time.monotonic() - self._began
        if waited >= self._next and waited < READY_LIMIT:
            self._report(f"{self._what} is not ready after {waited:.0f} s; waiting for up to {READY_LIMIT:g} s")
            self._next += READY_PERIOD
        return waited >= READY_LIMIT


def describe_exit(status: int) -> str:
    """Return an exit status in words."""
    if status >= 0:
        return f"ended with status {status}"
    try:
        return f"was ended by {signal.Signals(-status).name}"
    except ValueError:
        return f"was ended by signal {-status}"


class RestartDelay:
    """Back-off of a repeated failure [s]."""

    def __init__(self) -> None:
        self._next = 0.0

    def after(self, lasted: float) -> float:
        """Return the delay [s] after a failure of something that `lasted` this long [s]."""
        wait = 0.0 if lasted >= _FORGIVEN else self._next
        self._next = min(_MAX_WAIT, max(_FIRST_WAIT, 2 * wait))
        return wait
