"""Rule that ends the runs of a trial once its result is known well enough: the width of a 95 % interval.

The rule looks at the runs of the seeds 1, 2, 3, … in this order alone, whichever ended first. So the same seeds count
for any number of processes, and for an evaluation that was interrupted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cellwright.running.evaluation.results.intervals import Interval, rate_interval
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.summary import (
    Threshold,
    passed_count,
    passed_interval,
    scored,
    share_interval,
)

LEAST, MOST = 10, 200
"""Numbers of seeds, unless others are given."""


@dataclass(frozen=True, slots=True)
class WidthRule:
    """Rule on the number of seeds of a trial.

    It narrows the interval of the share of runs that pass if passing is defined, by a threshold or by the trial's task.
    Otherwise it is that of the mean share of the attainable points.

    Attributes:
        width: widest interval, as a share, that is narrow enough: more than 0, at most 1.
        least: seeds that count at least, from 2.
        most: seeds after which a trial ends in any case.
        threshold: score below which a run does not pass, if any.

    Example:
        >>> WidthRule(0.14).least_end([])
        10
    """

    width: float
    least: int = LEAST
    most: int = MOST
    threshold: Threshold | None = None

    def is_met(self, group: Sequence[Result]) -> bool:
        """Return whether the runs of the first seeds of a trial are enough.

        Runs without an interval are: seeds that change nothing, or no points to earn. More of them tell nothing.
        """
        if len(group) < self.least:
            return False
        interval = self.interval(group)
        return len(group) >= self.most or interval is None or interval[1] - interval[0] <= self.width

    def interval(self, group: Sequence[Result]) -> Interval | None:
        """Return the interval that the rule narrows, 0 to 1; None if there is none."""
        return passed_interval(group, self.threshold) if self._is_of_rate(group) else share_interval(group)

    def least_end(self, group: Sequence[Result]) -> int:
        """Return a number of seeds that counts in any case, more than those of a `group` that is not enough.

        Of a rate it is the smallest number that can be enough: all further runs pass, or none does.
        """
        first = max(len(group) + 1, self.least)
        if not group or not self._is_of_rate(group) or len(scored(group)) < len(group):
            return min(first, self.most)
        passed, count = passed_count(group, self.threshold)
        for end in range(first, self.most):
            for successes in (passed, passed + end - count):
                low, high = rate_interval(successes, end) or (0.0, 1.0)
                if high - low <= self.width:
                    return end
        return self.most

    def _is_of_rate(self, group: Sequence[Result]) -> bool:
        return self.threshold is not None or any(result.success is not None for result in group)
