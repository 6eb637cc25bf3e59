"""Power of a comparison: which difference between two programs a number of seeds can show, and how many one takes.

The tests are those of the verdict, one for each direction at a level of 2.5 %, so 5 % together. A difference is visible
if they find it in 80 % of experiments.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from cellwright.running.evaluation.results.verdict import LEVEL

POWER = 0.8
"""Share of experiments in which a visible difference is found."""
SEEDS = (10, 20, 50, 100, 200, 500)
"""Numbers of seeds in a table of power."""
MAX_NEEDED = 100_000
"""Number of seeds up to which the necessary number is computed."""

_ALPHA, _BETA = NormalDist().inv_cdf(1.0 - LEVEL), NormalDist().inv_cdf(POWER)
_NO_SPREAD = 1e-9  # of shares that are the same, but for rounding
_EXACT = 400  # pairs up to which the necessary number is exact
_ROUNDS = 14  # of a bisection: to a hundredth of a percent


@dataclass(frozen=True, slots=True)
class Power:
    """Power of a comparison of two programs for one value, 0 to 1.

    Attributes:
        seeds: seeds that both programs have.
        visible: difference that it shows with these seeds, and with the numbers of `SEEDS`; None for none.
        needed: seeds that show the difference that was seen; None if there is none, or for more than `MAX_NEEDED`.
    """

    seeds: int
    visible: Mapping[int, float | None]
    needed: int | None

    @classmethod
    def of_mean(cls, seeds: int, difference: float, deviation: float) -> Self:
        """Return the power for means, by the difference that was seen and the deviation of those of the seeds."""
        numbers = sorted({seeds, *SEEDS})
        visible = {number: visible_mean(number, deviation) for number in numbers}
        return cls(seeds, visible, needed_for_mean(difference, deviation))

    @classmethod
    def of_rate(cls, seeds: int, lost: float, gained: float) -> Self:
        """Return the power for rates of one trial, by the shares of the seeds that turned either way."""
        numbers = sorted({seeds, *SEEDS})
        return cls(
            seeds, {number: visible_rate(number, lost + gained) for number in numbers}, needed_for_rate(lost, gained)
        )

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON values."""
        visible = [{"seeds": number, "difference": each} for number, each in self.visible.items()]
        return {"seeds": self.seeds, "power": POWER, "level": 2.0 * LEVEL, "visible": visible, "needed": self.needed}


def visible_mean(pairs: int, deviation: float) -> float | None:
    """Return the mean difference that a number of pairs shows; None if it is too few for any, or nothing has a spread.

    Args:
        pairs: independent pairs.
        deviation: standard deviation of the differences of pairs, in the unit of the result.

    Example:
        >>> round(visible_mean(34, 1.0), 2)
        0.49
    """
    # Normal quantiles with the correction for Student's test of W. C. Guenther, The American Statistician 35 (1981).
    free = pairs - _ALPHA**2 / 2.0
    return deviation * (_ALPHA + _BETA) / math.sqrt(free) if free > 0.0 and deviation > _NO_SPREAD else None


def needed_for_mean(difference: float, deviation: float) -> int | None:
    """Return how many pairs show a mean difference; None for more than `MAX_NEEDED`, or if nothing has a spread.

    Example:
        >>> needed_for_mean(0.5, 1.0)
        34
    """
    if not difference or deviation <= _NO_SPREAD:
        return None
    found = math.ceil(((_ALPHA + _BETA) * deviation / difference) ** 2 + _ALPHA**2 / 2.0)
    return found if found <= MAX_NEEDED else None


def rate_power(pairs: int, lost: float, gained: float) -> float:
    """Return the exact chance that McNemar's test shows the larger of two chances: those of a pair to turn either way.

    Args:
        pairs: independent pairs.
        lost: chance that the first program passes and the second does not.
        gained: chance of the opposite.

    Example:
        >>> round(rate_power(144, 0.25, 0.45), 2)
        0.8
    """
    turned = lost + gained
    if not turned:
        return 0.0
    numbers = _binomial(pairs, min(1.0, turned))
    more = max(lost, gained) / turned
    return float(
        sum(
            chance * _binomial(count, more)[_critical(count) :].sum()
            for count, chance in enumerate(numbers.tolist())
            if chance > 1e-12
        )
    )


def visible_rate(pairs: int, turned: float) -> float | None:
    """Return the difference of two rates that a number of pairs shows; None if it is too few for any.

    Args:
        pairs: independent pairs.
        turned: share of pairs that turn either way. A difference that is larger turns as many pairs itself.
    """

    def is_shown(difference: float) -> bool:
        both = max(turned, difference)
        return rate_power(pairs, (both - difference) / 2.0, (both + difference) / 2.0) >= POWER

    low, high = 0.0, 1.0
    if not is_shown(high):
        return None
    for _ in range(_ROUNDS):
        middle = (low + high) / 2.0
        low, high = (low, middle) if is_shown(middle) else (middle, high)
    return high


def needed_for_rate(lost: float, gained: float) -> int | None:
    """Return how many pairs show the difference of two chances to turn; None for more than `MAX_NEEDED`.

    It is exact up to 400 pairs. Beyond that, where the exact test wants a few more, it is Connor's formula.

    Example:
        >>> needed_for_rate(0.1, 0.2)
        249
    """
    difference, turned = abs(gained - lost), lost + gained
    if not difference:
        return None
    # R. J. Connor, Biometrics 43 (1987), page 209
    root = _ALPHA * math.sqrt(turned) + _BETA * math.sqrt(max(0.0, turned - difference**2))
    found = math.ceil((root / difference) ** 2)
    while found < _EXACT and rate_power(found, lost, gained) < POWER:
        found += 1
    return found if found <= MAX_NEEDED else None


def _critical(count: int) -> int:
    """Return from how many of `count` turned pairs one way on the sign test shows it; more than `count` for none."""
    tail = np.cumsum(_binomial(count, 0.5)[::-1])
    return count + 1 - int(np.searchsorted(tail, LEVEL, side="right"))


def _binomial(count: int, chance: float) -> NDArray[np.float64]:
    """Return the chances of 0 to `count` successes."""
    if chance in (0.0, 1.0):
        certain = np.zeros(count + 1)
        certain[round(chance) * count] = 1.0
        return certain
    numbers = np.arange(count + 1)
    logs = np.array([math.lgamma(each + 1.0) for each in range(count + 1)])
    ways: NDArray[np.float64] = logs[-1] - logs - logs[::-1]
    found: NDArray[np.float64] = np.exp(ways + numbers * math.log(chance) + (count - numbers) * math.log1p(-chance))
    return found
