"""Tests of the rule on the width of an interval: where it ends, and what its intervals cover."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.running.evaluation.results.intervals import rate_interval
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.summary import Threshold
from cellwright.running.evaluation.results.width_rule import WidthRule
from tests.running.evaluation.made_results import result, worked

FULL = Threshold(1.0, is_share=True)


def runs(passed: Sequence[bool]) -> list[Result]:
    return [result(12.0 if each else 0.0, seed=seed) for seed, each in enumerate(passed, start=1)]


@pytest.mark.parametrize(
    ("passed", "total"),
    # Wilson's interval is this narrow from these numbers on: 1.96 squared over itself and n for a rate of 100 %
    [(10, 10), (23, 24), (150, 195)],
)
def test_rate_is_known_well_enough_at_the_first_number_whose_interval_is_narrow(passed: int, total: int) -> None:
    low, high = rate_interval(passed, total) or (0.0, 1.0)
    group = runs([True] * passed + [False] * (total - passed))
    assert WidthRule(high - low, threshold=FULL).is_met(group)
    assert not WidthRule(high - low - 1e-6, threshold=FULL).is_met(group)


def test_number_of_seeds_stays_within_its_bounds() -> None:
    rule = WidthRule(0.5, 5, 8, FULL)
    assert [rule.is_met(runs([True] * count)) for count in range(2, 7)] == [False, False, False, True, True]
    mixed = [True, False] * 4
    assert [WidthRule(0.1, 5, 8, FULL).is_met(runs(mixed[:count])) for count in (6, 7, 8)] == [False, False, True]


def test_points_count_where_nothing_says_which_runs_pass() -> None:
    near, far = ([result(each, seed=seed) for seed, each in enumerate(points)] for points in ([6, 7] * 5, [0, 12] * 5))
    assert [WidthRule(0.2).is_met(near), WidthRule(0.2).is_met(far)] == [True, False]


def test_runs_that_seeds_do_not_change_are_enough_at_the_least_number() -> None:
    same = [worked(2.0, seed=seed) for seed in range(1, 11)]
    assert not WidthRule(0.01).is_met(same[:9])
    assert WidthRule(0.01).is_met(same)
    assert WidthRule(0.01).is_met([result(0.0, seed=seed, reachable=0.0) for seed in range(10)])


@given(passed=st.lists(st.booleans(), max_size=60), width=st.sampled_from([0.15, 0.2, 0.3, 0.5]))
def test_least_end_is_never_more_than_what_counts_in_the_end(passed: list[bool], width: float) -> None:
    rule = WidthRule(width, 5, 60, FULL)
    all_runs = runs([*passed, *[True] * (60 - len(passed))])
    end = next(count for count in range(61) if rule.is_met(all_runs[:count]))
    for count in range(end):
        assert count < rule.least_end(all_runs[:count]) <= end


def coverage(rate: float, rule: WidthRule) -> tuple[float, float, float]:
    """Return the coverage of the interval at the end of a rule, the mean number of runs, and the mean of the rates.

    They are exact: the chances of all numbers of passed runs are carried from run to run, and those that the rule ends
    are taken out.
    """
    covered = runs_in_all = seen = 0.0
    chances = np.ones(1)
    for count in range(1, rule.most + 1):
        chances = np.convolve(chances, [1.0 - rate, rate])
        for passed in np.flatnonzero(chances > 0.0).tolist() if count >= rule.least else []:
            low, high = rate_interval(passed, count) or (0.0, 1.0)
            if high - low <= rule.width or count == rule.most:
                covered += chances[passed] * (low <= rate <= high)
                runs_in_all += chances[passed] * count
                seen += chances[passed] * passed / count
                chances[passed] = 0.0
    return float(covered), float(runs_in_all), float(seen)


@pytest.mark.parametrize(
    ("rate", "covered", "number", "seen"),
    # the table of docs/compare.md
    [
        (0.5, 0.942, 192, 0.500),
        (0.7, 0.942, 160, 0.703),
        (0.8, 0.943, 121, 0.807),
        (0.9, 0.975, 67, 0.914),
        (0.95, 0.976, 42, 0.961),
        (0.99, 0.955, 27, 0.993),
    ],
)
def test_intervals_at_the_end_of_the_rule_have_the_documented_coverage(
    rate: float, covered: float, number: float, seen: float
) -> None:
    found = coverage(rate, WidthRule(0.14))
    assert found[0] == pytest.approx(covered, abs=5e-4)
    assert found[1] == pytest.approx(number, abs=0.5)
    assert found[2] == pytest.approx(seen, abs=5e-4)


def test_coverage_of_the_rule_is_near_95_percent_for_all_rates() -> None:
    found = [coverage(rate, WidthRule(0.2, 10, 100))[0] for rate in np.linspace(0.5, 0.98, 49)]
    assert min(found) >= 0.92, min(found)
    assert 0.94 <= float(np.mean(found)) <= 0.96, np.mean(found)


def test_rate_of_a_task_is_what_the_rule_narrows() -> None:
    succeeded = [result(0.0, seed=seed, success=True) for seed in range(1, 11)]
    low, high = rate_interval(10, 10) or (0.0, 1.0)
    assert WidthRule(high - low).is_met(succeeded)
    assert not WidthRule(high - low - 1e-6).is_met(succeeded)
