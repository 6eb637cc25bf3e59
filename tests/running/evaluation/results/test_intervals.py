"""Tests of confidence intervals: known values, algebra, and their coverage in simulated experiments."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.running.evaluation.results.intervals import (
    mean_interval,
    rate_interval,
    score_interval,
    student_quantile,
)

Samples: TypeAlias = "np.ndarray[tuple[int, ...], np.dtype[np.float64]]"
SCORES = st.lists(st.floats(min_value=0.0, max_value=12.0), min_size=2, max_size=30)
EXPERIMENTS = 10_000


@pytest.mark.parametrize(
    ("freedom", "quantile"),
    [(1, 12.7062), (2, 4.30265), (4, 2.77645), (19, 2.09302), (99, 1.98422), (100_000, 1.95999)],
)
def test_student_quantile_is_that_of_printed_tables(freedom: float, quantile: float) -> None:
    assert student_quantile(freedom) == pytest.approx(quantile, rel=2e-5)


def test_wilson_interval_has_published_values() -> None:
    assert rate_interval(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)  # Newcombe 1998, table I
    assert rate_interval(0, 20) == pytest.approx((0.0, 0.1611), abs=1e-4)
    assert rate_interval(1, 29) == pytest.approx((0.0061, 0.1718), abs=1e-4)
    assert rate_interval(0, 0) is None


def test_one_value_in_a_group_has_no_interval() -> None:
    assert score_interval([[3.0]], 12.0) is None
    assert score_interval([[3.0, 4.0], [3.0]], 12.0) is None
    assert mean_interval([[3.0]]) is None
    assert mean_interval([]) is None


def test_mean_interval_is_the_one_of_textbooks() -> None:
    low, high = interval(mean_interval([[1.0, 2.0, 3.0, 4.0, 5.0]]))
    assert (low, high) == pytest.approx((3.0 - 1.96324, 3.0 + 1.96324), abs=1e-4)


def interval(found: tuple[float, float] | None) -> tuple[float, float]:
    assert found is not None
    return found


@given(scores=SCORES)
def test_score_interval_contains_mean_and_stays_within_bounds(scores: list[float]) -> None:
    low, high = interval(score_interval([scores], 12.0))
    assert 0.0 <= low <= high <= 12.0 + 1e-9
    assert low - 1e-9 <= float(np.mean(scores)) <= high + 1e-9


@given(scores=SCORES, factor=st.floats(min_value=0.01, max_value=100.0))
def test_score_interval_scales_with_its_unit_and_mirrors(scores: list[float], factor: float) -> None:
    low, high = interval(score_interval([scores], 12.0))
    assert interval(score_interval([[factor * each for each in scores]], 12.0 * factor)) == pytest.approx(
        (factor * low, factor * high), rel=1e-6, abs=1e-6 * factor
    )
    mirrored = interval(score_interval([[12.0 - each for each in scores]], 12.0))
    assert mirrored == pytest.approx((12.0 - high, 12.0 - low), abs=1e-4)


@given(scores=SCORES)
def test_order_of_values_and_of_groups_does_not_matter(scores: list[float]) -> None:
    other = [1.0, 5.0, 9.0]
    first = interval(score_interval([scores, other], 12.0))
    assert interval(score_interval([other[::-1], sorted(scores)], 12.0)) == pytest.approx(first, abs=1e-6)


def test_equal_scores_still_leave_room_for_runs_that_differ() -> None:
    assert score_interval([[6.0] * 10], 6.0) == pytest.approx((6.0 * 0.7225, 6.0), abs=1e-3)
    assert score_interval([[3.0] * 10], 6.0) == pytest.approx((3.0 * 0.7225, 6.0 - 3.0 * 0.7225), abs=1e-3)
    assert mean_interval([[3.0] * 10]) == (3.0, 3.0)
    assert score_interval([[0.0] * 10], 0.0) == (0.0, 0.0)


def coverage(samples: Samples, truth: float, of: Callable[[list[float]], tuple[float, float] | None]) -> float:
    """Return the share of samples whose interval contains the true value."""
    ends = np.array([interval(of(sample)) for sample in samples.tolist()])
    return float(np.mean((ends[:, 0] <= truth) & (truth <= ends[:, 1])))


DISTRIBUTIONS: dict[str, Callable[[np.random.Generator, tuple[int, int]], Samples]] = {
    "normal": lambda rng, shape: np.clip(rng.normal(8.0, 1.0, shape), 0.0, 12.0),
    "uniform": lambda rng, shape: rng.uniform(2.0, 12.0, shape),
    "skewed": lambda rng, shape: 12.0 * rng.beta(4.0, 2.0, shape),
    "whole": lambda rng, shape: rng.choice(
        [12.0, 10.0, 8.0, 6.0, 4.0, 2.0, 0.0], shape, p=[0.3, 0.2, 0.15, 0.1, 0.1, 0.1, 0.05]
    ),
}
MEANS = {"normal": 8.0, "uniform": 7.0, "skewed": 8.0, "whole": 8.0}


@pytest.mark.slow
@pytest.mark.parametrize("count", [5, 20, 100])
@pytest.mark.parametrize("name", DISTRIBUTIONS)
def test_intervals_of_scores_contain_the_true_mean_in_95_percent_of_experiments(name: str, count: int) -> None:
    samples = DISTRIBUTIONS[name](np.random.default_rng(count), (EXPERIMENTS, count))
    found = coverage(samples, MEANS[name], lambda sample: score_interval([sample], 12.0))
    assert 0.93 <= found <= 0.97, found


@pytest.mark.slow
@pytest.mark.parametrize("count", [5, 20, 100])
@pytest.mark.parametrize("full", [0.7, 0.9, 0.95])
def test_intervals_of_scores_that_are_full_or_nothing_are_rather_too_wide(full: float, count: int) -> None:
    samples = np.where(np.random.default_rng(count).random((EXPERIMENTS, count)) < full, 12.0, 0.0)
    found = coverage(samples, 12.0 * full, lambda sample: score_interval([sample], 12.0))
    assert 0.93 <= found <= 0.999, found


@pytest.mark.slow
@pytest.mark.parametrize("count", [5, 20, 100])
def test_intervals_over_two_trials_contain_the_true_mean(count: int) -> None:
    rng = np.random.default_rng(count)
    first, second = rng.beta(4.0, 2.0, (EXPERIMENTS, count)), rng.beta(2.0, 2.0, (EXPERIMENTS, 2 * count))
    truth = (4.0 / 6.0 + 2.0 * 0.5) / 3.0
    both = np.concatenate((first, second), axis=1)
    found = coverage(both, truth, lambda sample: score_interval([sample[:count], sample[count:]], 1.0))
    assert 0.93 <= found <= 0.97, found


def exact_coverage(rate: float, count: int) -> float:
    """Return the coverage of the interval of a rate, by the binomial distribution."""
    return sum(
        math.comb(count, k) * rate**k * (1.0 - rate) ** (count - k)
        for k in range(count + 1)
        if (ends := interval(rate_interval(k, count)))[0] <= rate <= ends[1]
    )


@pytest.mark.parametrize(
    ("count", "least", "most"),
    # of true rates from 50 to 90 %: 5 runs have six intervals alone, so that coverage jumps; its mean is near 95 %
    [(5, 0.89, 0.993), (20, 0.92, 0.982), (100, 0.93, 0.97)],
)
def test_intervals_of_rates_contain_the_true_rate(count: int, least: float, most: float) -> None:
    found = [exact_coverage(rate, count) for rate in np.linspace(0.5, 0.9, 401)]
    assert least <= min(found), min(found)
    assert max(found) <= most, max(found)
    assert 0.93 <= float(np.mean(found)) <= 0.97


def test_values_of_one_seed_in_several_groups_count_as_one_draw() -> None:
    # the means of the seeds are 2, 3, 4: their interval is that of a textbook
    groups, seeds = [[1.0, 2.0, 3.0], [3.0, 4.0, 5.0]], [[1, 2, 3], [1, 2, 3]]
    assert mean_interval(groups, seeds) == pytest.approx(interval(mean_interval([[2.0, 3.0, 4.0]])))
    # in the opposite order the seeds cancel each other out
    low, high = interval(mean_interval([groups[0], groups[1][::-1]], seeds))
    assert (low, high) == pytest.approx((3.0, 3.0))


@given(first=SCORES, second=SCORES)
def test_seeds_that_no_two_groups_share_change_nothing(first: list[float], second: list[float]) -> None:
    seeds = [list(range(len(first))), list(range(100, 100 + len(second)))]
    assert mean_interval([first, second], seeds) == mean_interval([first, second])
    assert score_interval([first, second], 12.0, seeds) == score_interval([first, second], 12.0)


@given(values=st.lists(st.tuples(*[st.floats(0.0, 12.0)] * 3), min_size=2, max_size=15))
def test_same_seeds_in_each_group_give_the_interval_of_the_means_of_the_seeds(
    values: list[tuple[float, float, float]],
) -> None:
    groups = [[each[trial] for each in values] for trial in range(3)]
    means = [sum(each) / 3.0 for each in values]
    low, high = interval(mean_interval([means]))
    found = interval(mean_interval(groups, [list(range(len(values)))] * 3))
    half = (found[1] - found[0]) / 2.0
    assert sum(found) / 2.0 == pytest.approx((low + high) / 2.0, abs=1e-9)
    # Welch's degrees of freedom may be fewer than those of the seeds, and never are more
    assert half >= (high - low) / 2.0 - 1e-6


@pytest.mark.slow
def test_interval_over_a_sweep_contains_the_true_mean_although_its_runs_share_their_seeds() -> None:
    rng, count, values = np.random.default_rng(1), 20, 5
    seeds = rng.beta(4.0, 2.0, (EXPERIMENTS, count))
    runs = np.clip(seeds[:, None, :] + rng.normal(0.0, 0.02, (EXPERIMENTS, values, count)), 0.0, 1.0)
    shared = [list(range(count))] * values
    clustered = coverage(runs, 4.0 / 6.0, lambda sample: score_interval(sample, 1.0, shared))  # type: ignore[arg-type]
    as_if_independent = coverage(runs, 4.0 / 6.0, lambda sample: score_interval(sample, 1.0))  # type: ignore[arg-type]
    assert 0.93 <= clustered <= 0.97, clustered
    assert as_if_independent < 0.7, as_if_independent
