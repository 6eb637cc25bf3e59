"""Event loop of the bridge: sockets, timers, calls from other threads, and a throttled log on stderr."""

from __future__ import annotations

import contextlib
import heapq
import itertools
import logging
import selectors
import signal
import socket
import sys
import time
from collections import deque
from typing import Any, Callable, TextIO


class MissingError(Exception):
    """What is needed is not there; the text says what."""


def report(line: str) -> None:
    """Say something in one line, on stderr."""
    _write_line(sys.stderr, line)


def say_ready(more: str = "") -> None:
    """Say that all is there: the one line on stdout."""
    _write_line(sys.stdout, f"ready {more}".rstrip())


def _write_line(stream: TextIO, line: str) -> None:
    """Write a line. When nobody can hear it any more, that is no error."""
    with contextlib.suppress(OSError, ValueError):
        stream.write(line.replace("\n", " ") + "\n")
        stream.flush()


Callback = Callable[[], None]


class Loop:
    """Calls what is due, in one thread, until it is stopped.

    Everything that belongs to the loop is touched by its thread alone; other threads use `call`.
    """

    def __init__(self) -> None:
        self._selector = selectors.DefaultSelector()
        self._asked: deque[tuple[Callable[..., None], tuple[Any, ...]]] = deque()
        self._timers: list[tuple[float, int, Callback]] = []
        self._serial = itertools.count()
        self._ear, self._bell = socket.socketpair()
        self._ear.setblocking(False)
        self._bell.setblocking(False)
        self._selector.register(self._ear, selectors.EVENT_READ, (self._hear, None))
        self._is_awake = False
        self._status: int | None = None

    def wake_by_signals(self) -> None:
        """Let a signal end the wait at once; for a loop in the main thread."""
        signal.set_wakeup_fd(self._bell.fileno(), warn_on_full_buffer=False)

    def call(self, function: Callable[..., None], *arguments: Any) -> None:
        """Have a function called by the loop's thread, soon; from any thread."""
        self._asked.append((function, arguments))
        if not self._is_awake:
            self._is_awake = True
            with contextlib.suppress(OSError):  # the bell rings already, or nobody waits any more
                self._bell.send(b"\0")

    def later(self, delay: float, function: Callback) -> None:
        """Have a function called after a delay [s]; from the loop's thread."""
        heapq.heappush(self._timers, (time.monotonic() + delay, next(self._serial), function))

    def watch(self, source: Any, on_read: Callback, on_write: Callback | None = None) -> None:
        """Call `on_read` while there is something to read from a socket or pipe, and `on_write` when it takes bytes.

        Called again for the same source it replaces what was said before.
        """
        events = selectors.EVENT_READ | (selectors.EVENT_WRITE if on_write else 0)
        try:
            self._selector.modify(source, events, (on_read, on_write))
        except KeyError:
            self._selector.register(source, events, (on_read, on_write))

    def forget(self, source: Any) -> None:
        """Watch a source no longer; before it is closed. One that is not watched is no error."""
        with contextlib.suppress(KeyError, ValueError):
            self._selector.unregister(source)

    def stop(self, status: int) -> None:
        """End `run` with a status; the first one that is given counts. From any thread, and from a signal handler."""
        if self._status is None:
            self._status = status
        self.call(nothing)

    def close(self) -> None:
        """Let go of what it waits with. What it watched is not closed."""
        self._selector.close()
        self._ear.close()
        self._bell.close()

    def run(self) -> int:
        """Wait and call until stopped; the status. Then it may run again."""
        while self._status is None:
            patience = max(0.0, self._timers[0][0] - time.monotonic()) if self._timers else None
            for key, events in self._selector.select(patience):
                on_read, on_write = key.data
                if events & selectors.EVENT_WRITE and on_write is not None:
                    self._do(on_write)
                if events & selectors.EVENT_READ:
                    self._do(on_read)
            while self._timers and self._timers[0][0] <= time.monotonic():
                self._do(heapq.heappop(self._timers)[2])
        status, self._status = self._status, None
        return status

    def _hear(self) -> None:
        with contextlib.suppress(OSError):
            while len(self._ear.recv(4096)) == 4096:
                pass
        # Only now: were it said before, a bell that rings meanwhile would be listened away, and no other ever rung.
        self._is_awake = False
        for _ in range(len(self._asked)):
            function, arguments = self._asked.popleft()
            self._do(function, *arguments)
        if self._asked:
            self.call(nothing)

    def _do(self, function: Callable[..., None], *arguments: Any) -> None:
        """Call a function; a defect in it costs what it was doing, and not the process."""
        try:
            function(*arguments)
        except Exception as defect:
            logging.getLogger("rospy.cellwright").exception("a defect")
            report(f"a defect, please report it: {type(defect).__name__}: {defect}")


def nothing(*_arguments: object) -> None:
    """Do nothing."""


LOG_PERIOD = 1.0  # time between two lines about the same [s]


class ThrottledLog:
    """Counts by subject; the first is said at once, those that follow within a second with the next line.

    The line has `{subject}`, and `{count}` for how often it happened since the last one.
    """

    def __init__(self, loop: Loop, text: str) -> None:
        self._loop = loop
        self._text = text
        self._counts: dict[str, int] = {}

    def count(self, subject: str) -> None:
        """Count one more for a subject; from any thread."""
        self._loop.call(self._count, subject)

    def _count(self, subject: str) -> None:
        is_known = subject in self._counts
        self._counts[subject] = self._counts.get(subject, 0) + 1
        if not is_known:
            self._say(subject)

    def _say(self, subject: str) -> None:
        """Say what was counted, and look again in a second; a subject that has come to rest is forgotten."""
        count = self._counts[subject]
        if count == 0:
            del self._counts[subject]
            return
        self._counts[subject] = 0
        report(self._text.format(subject=subject, count=count))
        self._loop.later(LOG_PERIOD, lambda: self._say(subject))
