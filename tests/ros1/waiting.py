"""Waiting for something to become true, with a limit instead of a sleep."""

import time
from collections.abc import Callable


def until(condition: Callable[[], object], within: float, what: str) -> None:
    """Wait until a condition holds.

    Args:
        condition: asked every 20 ms.
        within: the limit [s].
        what: what is waited for, for the message when it does not come.
    """
    end = time.monotonic() + within
    while not condition():
        assert time.monotonic() < end, f"no {what} within {within:g} s"
        time.sleep(0.02)
