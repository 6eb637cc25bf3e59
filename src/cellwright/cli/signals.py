"""Signals that end a command, from Ctrl-C or a service manager: noted at once, and obeyed between two steps."""

import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import Any, Protocol

_POLL_PERIOD = 0.1  # [s]


@contextmanager
def stopped_by_signals(stop: Callable[[], None]) -> Iterator[None]:
    """Let the first Ctrl-C, SIGTERM or SIGHUP call `stop`; the second has its usual effect.

    SIGHUP comes when a terminal is closed; a process that ignores it, as under nohup, is to outlive that.
    """
    with _handled(stop, _end_signals()):
        yield


class Kept(Protocol):
    """Something that runs until it is closed, such as a page."""

    @property
    def is_running(self) -> bool:
        """True until it has ended."""
        ...

    def close(self) -> None:
        """End it."""
        ...


def keep_until_signal(start: Callable[[], Kept]) -> None:
    """Start something, keep it until one of these signals comes or it has ended, and close it."""
    has_come = threading.Event()
    with stopped_by_signals(has_come.set):  # before it is announced
        kept = start()
        try:
            while kept.is_running and not has_come.wait(_POLL_PERIOD):
                pass
        finally:
            kept.close()


@contextmanager
def ended_as_by_ctrl_c() -> Iterator[None]:
    """Let the first SIGTERM or SIGHUP act as Ctrl-C does: the work ends, and the results so far are printed."""

    def interrupt() -> None:
        raise KeyboardInterrupt

    with _handled(interrupt, [number for number in _end_signals() if number != signal.SIGINT]):
        yield


@contextmanager
def _handled(act: Callable[[], None], numbers: Sequence[int]) -> Iterator[None]:
    before: dict[int, Any] = {}
    has_come = False

    def note(number: int, _frame: FrameType | None) -> None:
        nonlocal has_come
        restore()
        # Another handler has been set since.
        if has_come:
            signal.raise_signal(number)
            return
        has_come = True
        act()

    def restore() -> None:
        for each, handler in before.items():
            signal.signal(each, handler)

    if threading.current_thread() is threading.main_thread():
        for number in numbers:
            before[number] = signal.signal(number, note)
    try:
        yield
    finally:
        restore()


def _end_signals() -> list[int]:
    """Return the signals that request the end of this process, and that it may handle."""
    numbers: list[int] = [signal.SIGINT, signal.SIGTERM]
    if sys.platform != "win32" and signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        numbers.append(signal.SIGHUP)
    return numbers
