"""The terminal's keyboard, key by key: no line has to be finished, and nothing is echoed.

The terminal is put back as it was however this ends: by a return, an exception, Ctrl-C, SIGTERM, or by the window being
closed.
"""

from __future__ import annotations

import codecs
import os
import select
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, NoReturn

from cellwright.util.errors import UsageError

_PIECE = 4096
_GONE = "\x03"  # a keyboard that is gone wants no more than one that says Ctrl-C

Read = Callable[[], str]
"""What has been typed since the last call; never waits."""


class TerminatedError(BaseException):
    """A signal wants this process to end; like KeyboardInterrupt no `except Exception` may hold it up."""


@contextmanager
def keyboard() -> Iterator[Read]:
    """The keyboard of the terminal on stdin.

    Raises:
        UsageError: there is none.
        TerminatedError: from inside, when the process is asked to end.
    """
    if sys.stdin is None or not sys.stdin.isatty():
        raise UsageError("stdin is no terminal: the keyboard operator needs one to read keys from")
    if sys.platform == "win32":
        yield _read_windows
    else:
        with _ended_by_signals(), _key_by_key(sys.stdin.fileno()) as read:
            yield read


if sys.platform == "win32":
    import msvcrt

    _NAMED = {"H": "[A", "P": "[B", "M": "[C", "K": "[D", "G": "[H", "O": "[F", "I": "[5~", "Q": "[6~"}

    def _read_windows() -> str:
        text = ""
        while msvcrt.kbhit():
            sign = msvcrt.getwch()
            if sign in ("\x00", "\xe0"):  # an arrow or its like: the next one says which
                name = _NAMED.get(msvcrt.getwch(), "")
                sign = f"\x1b{name}" if name else ""
            text += sign
        return text

else:
    import termios
    import tty

    @contextmanager
    def _key_by_key(descriptor: int) -> Iterator[Read]:
        before = termios.tcgetattr(descriptor)
        decoder = codecs.getincrementaldecoder("utf-8")("replace")

        def read() -> str:
            if not select.select([descriptor], (), (), 0.0)[0]:
                return ""
            try:
                data = os.read(descriptor, _PIECE)
            except OSError:
                data = b""
            return decoder.decode(data) if data else _GONE

        try:
            tty.setcbreak(descriptor)  # Ctrl-C still is a signal
            mode = termios.tcgetattr(descriptor)
            for key in (termios.VSUSP, termios.VQUIT):  # these would leave the terminal to the shell as it is now
                mode[6][key] = b"\x00"
            termios.tcsetattr(descriptor, termios.TCSANOW, mode)
            yield read
        finally:
            termios.tcsetattr(descriptor, termios.TCSAFLUSH, before)


@contextmanager
def _ended_by_signals() -> Iterator[None]:
    """Let SIGTERM and SIGHUP be exceptions, so that what has to be put back is."""
    before: dict[int, Any] = {}

    def end(number: int, _frame: FrameType | None) -> NoReturn:
        raise TerminatedError(signal.Signals(number).name)

    if threading.current_thread() is threading.main_thread():
        for name in ("SIGTERM", "SIGHUP"):
            number = getattr(signal, name)
            before[number] = signal.signal(number, end)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
