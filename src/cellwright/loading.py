"""What a process may be told while it is still loading: there is nothing to tidy up yet."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


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
