"""Verdict on paired runs of two programs, by exact tests that fit few pairs.

A pair is one trial with one seed, so its difference is a fact: what is uncertain is whether other seeds show it too.
Two equal programs may be swapped in each pair. So the signs of all differences are flipped in every combination, and
the chance is the share of combinations that lose at least as much as was seen. No form of distribution is assumed.

Up to five pairs have too few combinations for any proof (2 to the power of 5 is 32). If all of them lose, their runs
are also dealt to the two programs in every way. That is exact if the runs of equal programs with one seed are
independent, and cautious if they are alike, as runs with one seed mostly are.

Both tests are monotone: a larger loss of a pair never makes the chance larger. A further losing pair makes that of the
signs smaller. Only from four pairs to five, where runs are dealt, may a small loss make it larger.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import combinations
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

LEVEL = 0.025
"""Largest chance of a shown loss, of each of two questions: points and runs done. Together they have 5 %."""
MAX_PAIRS = 500
"""Pairs up to which the necessary number is searched."""

_FEW = 5
_ENUMERATED = 12  # differences up to which all sums are computed
_BINS = 8_192  # from zero to the largest sum of more differences
_TINY = 1e-9

Values: TypeAlias = NDArray[np.float64]


class Verdict(StrEnum):
    """Verdict on the second program, the most serious last."""

    BETTER = "better"
    NOT_WORSE = "not worse"
    INCONCLUSIVE = "inconclusive"
    WORSE = "worse"


@dataclass(frozen=True, slots=True)
class Judgement:
    """Judgement of one question.

    Attributes:
        verdict: the verdict.
        chance: chance that a program without a loss beyond the margin has lost as much (p); None if no seed matters.
    """

    verdict: Verdict
    chance: float | None


def judge(sampled: Sequence[tuple[float, float]], fixed: Sequence[float], margin: float) -> Judgement:
    """Judge whether the second program is worse than the first by more than a margin, on the mean of all pairs.

    It is worse if its loss is shown to exceed the margin, and not worse if no pair loses more than that, or if a mean
    loss beyond it is shown not to be there. The latter takes the worst pair twice: a rare large loss may be missed.

    Args:
        sampled: values of both programs, 0 to 1, for each pair whose seed matters.
        fixed: differences of the pairs that every seed would repeat.
        margin: loss that is accepted, 0 to 1.

    Example:
        >>> judge([(1.0, 0.7), (1.0, 0.0), (1.0, 0.7), (1.0, 0.7)], [], 0.0).verdict
        <Verdict.WORSE: 'worse'>
        >>> judge([(1.0, 0.7), (0.9, 0.9)], [], 0.0).verdict
        <Verdict.INCONCLUSIVE: 'inconclusive'>
    """
    if not sampled:
        mean = sum(fixed) / len(fixed)
        lost, gained = mean < -margin - _TINY, mean > _TINY
        return Judgement(Verdict.WORSE if lost else Verdict.BETTER if gained else Verdict.NOT_WORSE, None)
    return Judgement(*_judge(np.array(sampled, np.float64), *_shifts(sampled, fixed, margin)))


def more_pairs(sampled: Sequence[tuple[float, float]], fixed: Sequence[float], margin: float) -> int | None:
    """Return how many more pairs, distributed like these, end an inconclusive judgement; None if it takes `MAX_PAIRS`.

    Arguments are those of `judge`.
    """
    pairs = np.array(sorted(sampled, key=lambda pair: pair[1] - pair[0]), np.float64)
    known, shift = _shifts(sampled, fixed, margin)
    count = len(pairs)

    def is_enough(wanted: int) -> bool:
        like_those = pairs[((np.arange(wanted) + 0.5) * count / wanted).astype(int)]
        return _judge(like_those, known, shift)[0] is not Verdict.INCONCLUSIVE

    # Doubled until it is enough, then halved to a sixteenth: each try costs all sums.
    few, enough = count, 2 * count
    while not is_enough(enough):
        few, enough = enough, 2 * enough
        if few >= MAX_PAIRS:
            return None
    while enough - few > max(1, few // 16):
        middle = (few + enough) // 2
        few, enough = (few, middle) if is_enough(middle) else (middle, enough)
    return enough - count


def _shifts(sampled: Sequence[tuple[float, float]], fixed: Sequence[float], margin: float) -> tuple[float, float]:
    """Return the sum of the fixed differences for each sampled pair, without and with the margin of all pairs."""
    known = sum(fixed) / len(sampled)
    return known, known + margin * (1.0 + len(fixed) / len(sampled))


def _judge(pairs: Values, known: float, shift: float) -> tuple[Verdict, float]:
    """Return the verdict and the chance of the loss.

    Args:
        pairs: values of both programs, shape (n, 2).
        known: known gain of each pair, from the fixed differences.
        shift: the same, and the margin.
    """
    before, after = pairs.T
    chance = loss_chance(before, after + shift)
    if chance <= LEVEL:
        return Verdict.WORSE, chance
    differences = after + shift - before
    if loss_chance(after + known, before) <= LEVEL:
        return Verdict.BETTER, chance
    # A rare large loss may be missing among few pairs. So the worst one is taken for more frequent than it was.
    twice = np.append(differences, differences.min())
    gain = max(flip_chance(-differences), flip_chance(-twice))
    is_shown = gain <= LEVEL or bool((differences >= -_TINY).all())
    return Verdict.NOT_WORSE if is_shown else Verdict.INCONCLUSIVE, chance


def loss_chance(before: Values, after: Values) -> float:
    """Return the chance that of two equal programs the second loses at least as much against the first as here."""
    differences = after - before
    chance = flip_chance(differences)
    if len(differences) <= _FEW and bool((differences < -_TINY).all()):
        return min(chance, deal_chance(before, after))
    return chance


def flip_chance(differences: Values) -> float:
    """Return the share of all combinations of signs whose sum is at most that of the differences."""
    sizes, total = np.abs(differences[np.abs(differences) > _TINY]), float(differences.sum())
    if len(sizes) > _ENUMERATED:
        return _binned_chance(sizes, total)
    sums = np.zeros(1)
    for size in sizes:
        sums = np.concatenate((sums - size, sums + size))
    return float(np.mean(sums <= total + _TINY))


def _binned_chance(sizes: Values, total: float) -> float:
    """Return the chance of a sum up to `total`, from the distribution of sums of rounded sizes, added one by one."""
    bin_size = float(sizes.sum()) / _BINS
    steps = np.rint(sizes / bin_size).astype(int)
    middle = int(steps.sum())
    chances = np.zeros(2 * middle + 1)
    chances[middle] = 1.0
    reach = 0
    for step in steps.tolist():
        inner = chances[middle - reach : middle + reach + 1].copy()
        chances[middle - reach : middle + reach + 1] = 0.0
        chances[middle - reach - step : middle + reach - step + 1] += inner / 2.0
        chances[middle - reach + step : middle + reach + step + 1] += inner / 2.0
        reach += step
    # Each size is rounded by half a bin at most, and n such errors add up to about sqrt(n / 12) bins.
    last = math.floor(total / bin_size + math.sqrt(len(sizes)))  # equal sums count, whatever the rounding
    return min(1.0, float(chances[: max(0, middle + last + 1)].sum()))


def deal_chance(before: Values, after: Values) -> float:
    """Return the share of all ways to deal the runs to the programs that give the second at most its present sum."""
    values, total = np.concatenate((before, after)), float(after.sum())
    sums = np.array([values[list(chosen)].sum() for chosen in combinations(range(len(values)), len(after))])
    return float(np.mean(sums <= total + _TINY))
