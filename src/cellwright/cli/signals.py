"""Ctrl-C, and a service's wish that a command end: taken note of, and followed between two steps."""

import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import Any


@contextmanager
def stopped_by_signals(stop: Callable[[], None]) -> Iterator[None]:
    """Let the first Ctrl-C, SIGTERM or SIGHUP call `stop`; the second does what it does everywhere.

    SIGHUP comes when a terminal is closed; who has it ignored, as nohup does, wants to outlive that.
    """
    with _followed(stop, _wishes()):
        yield


@contextmanager
def ended_as_by_ctrl_c() -> Iterator[None]:
    """Let the first SIGTERM or SIGHUP do what Ctrl-C does: what is at work ends, and tells what has come of it."""

    def interrupt() -> None:
        raise KeyboardInterrupt

    with _followed(interrupt, [number for number in _wishes() if number != signal.SIGINT]):
        yield


@contextmanager
def _followed(act: Callable[[], None], numbers: Sequence[int]) -> Iterator[None]:
    before: dict[int, Any] = {}
    has_come = False

    def note(number: int, _frame: FrameType | None) -> None:
        nonlocal has_come
        restore()
        if has_come:  # somebody has put this handler back since
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


def _wishes() -> list[int]:
    """The signals by which somebody wishes that this process end, and that it may follow."""
    numbers: list[int] = [signal.SIGINT, signal.SIGTERM]
    if sys.platform != "win32" and signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        numbers.append(signal.SIGHUP)
    return numbers
