"""Confidence intervals of rates, scores and other means, at a level of 95 %.

SciPy has such intervals too; see docs/dependencies.md for why these few lines are here.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from statistics import NormalDist, fmean
from typing import TypeAlias

import numpy as np

LEVEL = 0.95
"""Share of intervals that contain the true value."""

Interval: TypeAlias = tuple[float, float]
"""Lower and upper end, in the unit of the value."""

_NORMAL = NormalDist().inv_cdf((1.0 + LEVEL) / 2.0)
_POINTS = 2_001


@lru_cache(maxsize=1024)
def student_quantile(freedom: float) -> float:
    """Return the quantile of Student's distribution at `LEVEL`, two-sided.

    With t = sqrt(freedom) tan(angle), the density of the angle is cos(angle) to the power of freedom - 1.
    """
    angles = np.linspace(0.0, min(math.pi / 2.0, 12.0 / math.sqrt(freedom)), _POINTS)  # next to nothing lies beyond
    density = np.cos(angles) ** (freedom - 1.0)
    area = np.concatenate(([0.0], np.cumsum(density[1:] + density[:-1])))
    return math.sqrt(freedom) * math.tan(float(np.interp(LEVEL, area / area[-1], angles)))


def rate_interval(successes: int, count: int) -> Interval | None:
    """Return Wilson's interval of a rate, 0 to 1; None for a count of zero."""
    return _wilson(successes / count, count, _NORMAL) if count else None


def mean_interval(groups: Sequence[Sequence[float]]) -> Interval | None:
    """Return Student's interval of the mean of all values; None if a group has fewer than two.

    Groups are strata, such as trials: each keeps its number of values in a repeated experiment, and has its own
    variance (degrees of freedom of Welch and Satterthwaite).
    """
    if not _can_estimate(groups):
        return None
    squared_error, freedom = _error(groups)
    mean, half = _mean(groups), student_quantile(freedom) * math.sqrt(squared_error)
    return mean - half, mean + half


def score_interval(groups: Sequence[Sequence[float]], maximum: float) -> Interval | None:
    """Return the interval of the mean of scores that lie from 0 to `maximum`; None if a group has fewer than two.

    It is Wilson's interval of a rate, for the number of all-or-nothing runs whose mean has the error of these scores,
    with Student's quantile. Near the ends it stays within them and holds where Student's own interval does not.

    If all scores of each group are equal, they show no variance. Then runs that differ are taken to be as rare as their
    absence shows, and to have any score.
    """
    if not _can_estimate(groups):
        return None
    count, mean = sum(map(len, groups)), _mean(groups)
    share = mean / maximum if maximum > 0.0 else 1.0
    squared_error, freedom = _error(groups)
    if not 0.0 <= share <= 1.0 or maximum <= 0.0:
        return mean_interval(groups)
    if squared_error <= (1e-9 * maximum) ** 2:
        equal = _wilson(1.0, count, _NORMAL)[0]
        return mean * equal, mean * equal + maximum * (1.0 - equal)
    # n runs that earn all or nothing have the squared error p (1 - p) / n. Solved for n, with the error that was seen.
    equivalent = max(count, share * (1.0 - share) * maximum**2 / squared_error)
    low, high = _wilson(share, equivalent, student_quantile(freedom))
    return low * maximum, high * maximum


def _wilson(rate: float, count: float, quantile: float) -> Interval:
    # E. B. Wilson, Probable Inference, the Law of Succession, and Statistical Inference, JASA 22 (1927).
    squared = quantile**2 / count
    centre = (rate + squared / 2.0) / (1.0 + squared)
    half = math.sqrt(rate * (1.0 - rate) * squared + squared**2 / 4.0) / (1.0 + squared)
    return max(0.0, centre - half), min(1.0, centre + half)


def _can_estimate(groups: Sequence[Sequence[float]]) -> bool:
    return bool(groups) and all(len(group) > 1 for group in groups)


def _mean(groups: Sequence[Sequence[float]]) -> float:
    return fmean(value for group in groups for value in group)


def _error(groups: Sequence[Sequence[float]]) -> tuple[float, float]:
    """Return the squared standard error of the mean of all values, and its degrees of freedom."""
    count = sum(map(len, groups))
    # The variance of each stratum weighs with the square of its share. Degrees of freedom: B. L. Welch, Biometrika 34
    # (1947).
    terms = [(float(np.var(group, ddof=1)) * len(group) / count**2, len(group) - 1) for group in groups]
    total = sum(term for term, _ in terms)
    if total <= 0.0:
        return 0.0, float(count - len(groups))
    return total, 1.0 / sum((term / total) ** 2 / freedom for term, freedom in terms)
