"""Begin and end of a process: Ctrl-C while it loads, and threads that somebody's agent leaves running."""

from __future__ import annotations

import atexit
import os
import signal
import sys
import threading
import time
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress

PATIENCE = 2.0
"""How long threads may take to end when their process is done [s]."""


@contextmanager
def interrupts_end_the_process() -> Iterator[None]:
    """Let a Ctrl-C end the process as it does for most programs, with nothing said; afterwards it is as it was.

    Loading takes half a second, in which Python would show whoever presses Ctrl-C a traceback through its imports.
    Where a caller has set a handler of its own, or has Ctrl-C ignored, that stands; and so it does in a thread of its
    own, where none can be set.
    """
    is_main = threading.current_thread() is threading.main_thread()
    is_usual = is_main and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if is_usual:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        if is_usual:
            signal.signal(signal.SIGINT, signal.default_int_handler)


def end_despite_threads(before: Collection[threading.Thread], status: int) -> None:
    """End this process if threads go on that it would wait for, after `PATIENCE`; say so. Else return.

    Args:
        before: threads that are not ours.
        status: exit status.
    """
    own = {*before, threading.current_thread()}
    left = [thread for thread in threading.enumerate() if thread not in own and not thread.daemon]
    end = time.monotonic() + PATIENCE
    for thread in left:
        thread.join(max(0.0, end - time.monotonic()))
    names = [thread.name for thread in left if thread.is_alive()]
    if names:
        with suppress(OSError, ValueError):  # who listens has gone
            sys.stderr.write(f"left running, and ended with the process: {', '.join(names)}\n")
        with suppress(Exception):
            atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()
        os._exit(status)
