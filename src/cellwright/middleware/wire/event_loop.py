"""Event loop of a bridge: sockets, timers, calls from other threads, and a throttled log on stderr."""

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

LOG_PERIOD = 1.0  # time between two lines about the same subject [s]

Callback = Callable[[], None]


class MissingError(Exception):
    """Something required is missing; the text names it."""


def report(line: str) -> None:
    """Print a line on stderr."""
    _write_line(sys.stderr, line)


def report_ready(more: str = "") -> None:
    """Report readiness: print the one line on stdout."""
    _write_line(sys.stdout, f"ready {more}".rstrip())


def _write_line(stream: TextIO, line: str) -> None:
    """Write a line; a closed stream is no error."""
    with contextlib.suppress(OSError, ValueError):
        stream.write(line.replace("\n", " ") + "\n")
        stream.flush()


class EventLoop:
    """Event loop in one thread: calls what is due until it is stopped.

    Only its thread touches what belongs to the loop; other threads use `call`.
    """

    def __init__(self) -> None:
        self._selector = selectors.DefaultSelector()
        self._calls: deque[tuple[Callable[..., None], tuple[Any, ...]]] = deque()
        self._timers: list[tuple[float, int, Callback]] = []
        self._serial = itertools.count()
        self._wake_reader, self._wake_writer = socket.socketpair()
        self._wake_reader.setblocking(False)
        self._wake_writer.setblocking(False)
        self._selector.register(self._wake_reader, selectors.EVENT_READ, (self._on_wake, None))
        self._is_awake = False
        self._status: int | None = None

    def wake_by_signals(self) -> None:
        """End the wait at once on a signal; for a loop in the main thread."""
        signal.set_wakeup_fd(self._wake_writer.fileno(), warn_on_full_buffer=False)

    def call(self, function: Callable[..., None], *arguments: Any) -> None:
        """Call a function soon in the loop's thread; from any thread."""
        self._calls.append((function, arguments))
        if not self._is_awake:
            self._is_awake = True
            # The wake-up is pending already, or the loop is closed.
            with contextlib.suppress(OSError):
                self._wake_writer.send(b"\0")

    def later(self, delay: float, function: Callback) -> None:
        """Call a function after a delay [s]; from the loop's thread."""
        heapq.heappush(self._timers, (time.monotonic() + delay, next(self._serial), function))

    def watch(self, source: Any, on_read: Callback, on_write: Callback | None = None) -> None:
        """Call `on_read` while a socket or pipe is readable, and `on_write` when it is writable.

        A second call for the same source replaces the first.
        """
        events = selectors.EVENT_READ | (selectors.EVENT_WRITE if on_write else 0)
        try:
            self._selector.modify(source, events, (on_read, on_write))
        except KeyError:
            self._selector.register(source, events, (on_read, on_write))

    def forget(self, source: Any) -> None:
        """Stop watching a source, before it is closed; a source that is not watched is no error."""
        with contextlib.suppress(KeyError, ValueError):
            self._selector.unregister(source)

    def stop(self, status: int) -> None:
        """End `run` with a status; the first one counts. From any thread, and from a signal handler."""
        if self._status is None:
            self._status = status
        self.call(nothing)

    def close(self) -> None:
        """Release the loop's own descriptors; watched sources stay open."""
        self._selector.close()
        self._wake_reader.close()
        self._wake_writer.close()

    def run(self) -> int:
        """Wait and call until stopped; return the status. Then it may run again."""
        while self._status is None:
            timeout = max(0.0, self._timers[0][0] - time.monotonic()) if self._timers else None
            for key, events in self._selector.select(timeout):
                on_read, on_write = key.data
                if events & selectors.EVENT_WRITE and on_write is not None:
                    self._do(on_write)
                if events & selectors.EVENT_READ:
                    self._do(on_read)
            while self._timers and self._timers[0][0] <= time.monotonic():
                self._do(heapq.heappop(self._timers)[2])
        status, self._status = self._status, None
        return status

    def _on_wake(self) -> None:
        with contextlib.suppress(OSError):
            while len(self._wake_reader.recv(4096)) == 4096:
                pass
        # Only now: earlier, a concurrent wake-up would be read here, and no other one would follow.
        self._is_awake = False
        for _ in range(len(self._calls)):
            function, arguments = self._calls.popleft()
            self._do(function, *arguments)
        if self._calls:
            self.call(nothing)

    def _do(self, function: Callable[..., None], *arguments: Any) -> None:
        """Call a function; a defect in it does not end the process."""
        try:
            function(*arguments)
        except Exception as defect:
            logging.getLogger("rospy.cellwright").exception("a defect")
            report(f"internal error, please report it: {type(defect).__name__}: {defect}")


def nothing(*_arguments: object) -> None:
    """Do nothing."""


class ThrottledLog:
    """Log throttled by subject: reports the first event at once, and those within a second with the next line.

    The line has `{subject}`, and `{count}` for the number of events since the last one; `say` prints it if not given.
    """

    def __init__(self, loop: EventLoop, text: str, say: Callable[[str], None] | None = None) -> None:
        self._loop = loop
        self._text = text
        self._say = say or report
        self._counts: dict[str, int] = {}

    def count(self, subject: str, number: int = 1) -> None:
        """Count a number of events of a subject, if any; from any thread."""
        if number:
            self._loop.call(self._count, subject, number)

    def _count(self, subject: str, number: int) -> None:
        is_known = subject in self._counts
        self._counts[subject] = self._counts.get(subject, 0) + number
        if not is_known:
            self._report(subject)

    def _report(self, subject: str) -> None:
        """Report the count, and check again in a second; forget a subject without new events."""
        count = self._counts[subject]
        if count == 0:
            del self._counts[subject]
            return
        self._counts[subject] = 0
        self._say(self._text.format(subject=subject, count=count))
        self._loop.later(LOG_PERIOD, lambda: self._report(subject))
