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

Seeds: TypeAlias = Sequence[Sequence[int]] | None
"""Seed of each value, in the groups of the values. Values of one seed may depend on each other; None: none do."""

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


def mean_interval(groups: Sequence[Sequence[float]], seeds: Seeds = None) -> Interval | None:
    """Return Student's interval of the mean of all values; None if a group has fewer than two.

    Groups are strata, such as trials: each keeps its number of values in a repeated experiment, and has its own
    variance (degrees of freedom of Welch and Satterthwaite). With `seeds` see `error_of`.

    Example:
        >>> mean_interval([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0]]) == mean_interval([[1.0, 2.0, 3.0]])
        False
        >>> seeds = [[1, 2, 3], [1, 2, 3]]
        >>> mean_interval([[1.0, 2.0, 3.0], [1.0, 2.0, 3.0]], seeds) == mean_interval([[1.0, 2.0, 3.0]])
        True
    """
    if not _can_estimate(groups):
        return None
    squared_error, freedom = error_of(groups, seeds)
    mean, half = _mean(groups), student_quantile(freedom) * math.sqrt(squared_error)
    return mean - half, mean + half


def score_interval(groups: Sequence[Sequence[float]], maximum: float, seeds: Seeds = None) -> Interval | None:
    """Return the interval of the mean of scores that lie from 0 to `maximum`; None if a group has fewer than two.

    It is Wilson's interval of a rate, for the number of all-or-nothing runs whose mean has the error of these scores,
    with Student's quantile. Near the ends it stays within them and holds where Student's own interval does not.

    If all scores of each group are equal, they show no variance. Then runs that differ are taken to be as rare as their
    absence shows, and to have any score. Values of one seed count as one there.
    """
    if not _can_estimate(groups):
        return None
    count, mean = _clusters(groups, seeds), _mean(groups)
    share = mean / maximum if maximum > 0.0 else 1.0
    squared_error, freedom = error_of(groups, seeds)
    if not 0.0 <= share <= 1.0 or maximum <= 0.0:
        return mean_interval(groups, seeds)
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


def error_of(groups: Sequence[Sequence[float]], seeds: Seeds = None) -> tuple[float, float]:
    """Return the squared standard error of the mean of all values, and its degrees of freedom.

    With `seeds` it is the sandwich estimate for clusters: the residuals of one seed are summed over all groups before
    they are squared. So what a seed does to all of them alike counts in full. One cell laid out by a seed and run with
    five values of a sweep is one draw, and not five. If no seed is in two groups, it is the error without seeds.
    """
    count = sum(map(len, groups))
    # The variance of each stratum weighs with the square of its share. Degrees of freedom: B. L. Welch, Biometrika 34
    # (1947).
    terms = [(float(np.var(group, ddof=1)) * len(group) / count**2, len(group) - 1) for group in groups]
    total = sum(term for term, _ in terms)
    if total <= 0.0:
        return 0.0, float(_clusters(groups, seeds) - (len(groups) if seeds is None else 1))
    freedom = 1.0 / sum((term / total) ** 2 / freedom for term, freedom in terms)
    clusters = _clusters(groups, seeds)
    if seeds is None or clusters == count:
        return total, freedom
    # K.-Y. Liang and S. L. Zeger, Biometrika 73 (1986). The factor of each stratum removes the bias of its own mean;
    # with the same seeds in each group the estimate is exactly that of the means of the seeds.
    sums: dict[int, float] = {}
    for group, own in zip(groups, seeds, strict=True):
        mean, factor = fmean(group), math.sqrt(len(group) / (len(group) - 1))
        for value, seed in zip(group, own, strict=True):
            sums[seed] = sums.get(seed, 0.0) + factor * (value - mean)
    return math.fsum(each**2 for each in sums.values()) / count**2, min(freedom, clusters - 1.0)


def _clusters(groups: Sequence[Sequence[float]], seeds: Seeds) -> int:
    """Return the number of values that do not depend on each other."""
    return sum(map(len, groups)) if seeds is None else len({seed for own in seeds for seed in own})
