"""Times and what is made of many of them."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence


def processor_time(work: Callable[[], object]) -> float:
    """What some work takes of this process's processor time [s]: others at work on the machine disturb it least."""
    begin = time.process_time()
    work()
    return time.process_time() - begin


def best_in_turn(repeats: int, *works: Callable[[], float]) -> list[float]:
    """The least of what each returns, over so many repeats in turn: what the machine does besides falls on all."""
    found = [[work() for work in works] for _ in range(repeats)]
    return [min(times) for times in zip(*found, strict=True)]


def percentile(times: Sequence[float], percent: int) -> float:
    """What so many per cent of at least two values lie below."""
    return statistics.quantiles(times, n=100, method="inclusive")[percent - 1]
