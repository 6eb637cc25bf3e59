"""Ctrl-C, and a service's wish that a command end: taken note of, and followed between two steps."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any


@contextmanager
def stopped_by_signals(stop: Callable[[], None]) -> Iterator[None]:
    """Let the first Ctrl-C or SIGTERM call `stop`; the second does what it does everywhere."""
    before: dict[int, Any] = {}

    def note(_number: int, _frame: FrameType | None) -> None:
        stop()
        restore()

    def restore() -> None:
        while before:
            signal.signal(*before.popitem())

    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            before[number] = signal.signal(number, note)
    try:
        yield
    finally:
        restore()


class Stop:
    """A wish to end that may come before there is anything to end."""

    def __init__(self) -> None:
        self.has_come = False
        """Whether there is the wish."""
        self._stop: Callable[[], None] = lambda: None

    def stop(self) -> None:
        """Wish it; to be called from a signal's handler."""
        self.has_come = True
        self._stop()

    def follow(self, stop: Callable[[], None]) -> None:
        """Have `stop` called when there is the wish; at once if there is."""
        self._stop = stop
        if self.has_come:
            stop()
