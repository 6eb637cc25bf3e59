"""Waiting for something to become true, with a limit instead of a sleep."""

import time
from collections.abc import Callable


def until(condition: Callable[[], object], within: float, what: str | Callable[[], str]) -> None:
    """Wait until a condition holds.

    Args:
        condition: asked every 20 ms.
        within: the limit [s].
        what: what is waited for, for the message when it does not come; a function is asked then.
    """
    end = time.monotonic() + within
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"no {what if isinstance(what, str) else what()} within {within:g} s")
        time.sleep(0.02)
