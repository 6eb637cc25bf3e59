"""Timing of work, and statistics of times."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence


def processor_time(work: Callable[[], object]) -> float:
    """Return this process's processor time of some work [s]: other load on the machine disturbs it least."""
    begin = time.process_time()
    work()
    return time.process_time() - begin


def best_in_turn(repeats: int, *works: Callable[[], float]) -> list[float]:
    """Return the least result of each work over the repeats in turn, so that other load falls on all."""
    found = [[work() for work in works] for _ in range(repeats)]
    return [min(times) for times in zip(*found, strict=True)]


def percentile(times: Sequence[float], percent: int) -> float:
    """Return the percentile of at least two values."""
    return statistics.quantiles(times, n=100, method="inclusive")[percent - 1]
