"""What somebody's program may change of the process that it works in, put back when it has gone.

Results are written after it: to files whose paths are relative, and with numbers that are computed.
"""

from __future__ import annotations

import locale
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import current_thread, main_thread

import numpy as np

_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGALRM", "SIGUSR1") if hasattr(signal, name)
)


@contextmanager
def surroundings_kept() -> Iterator[None]:
    """Put back the working folder, what numpy does about errors, signal handlers, locale, streams and other switches.

    What cannot be put back is left: a folder that is gone, a handler that was not set in Python.
    """
    folder, errors, language = _folder(), np.geterr(), locale.setlocale(locale.LC_ALL)
    streams, depth = (sys.stdin, sys.stdout, sys.stderr), sys.getrecursionlimit()
    # only the main thread may set handlers; a program in another one has not changed any either
    handlers = {each: signal.getsignal(each) for each in _SIGNALS} if current_thread() is main_thread() else {}
    try:
        yield
    finally:
        with suppress(OSError):
            if folder and folder != _folder():
                os.chdir(folder)
        np.seterr(**errors)
        with suppress(locale.Error):
            locale.setlocale(locale.LC_ALL, language)
        sys.stdin, sys.stdout, sys.stderr = streams
        with suppress(RecursionError):
            sys.setrecursionlimit(depth)
        for number, handler in handlers.items():
            if handler is not None and signal.getsignal(number) is not handler:
                signal.signal(number, handler)


def _folder() -> str:
    """The working folder; empty if it is gone."""
    try:
        return os.getcwd()
    except OSError:
        return ""
