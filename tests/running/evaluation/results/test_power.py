"""Tests of the power of a comparison: published figures, algebra, and simulated experiments."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.running.evaluation.results.power import (
    POWER,
    needed_for_mean,
    needed_for_rate,
    rate_power,
    visible_mean,
    visible_rate,
)
from cellwright.running.evaluation.results.verdict import LEVEL, flip_chance


@pytest.mark.parametrize(("effect", "pairs"), [(0.2, 199), (0.5, 34), (0.8, 15)])
def test_pairs_for_a_mean_are_those_of_printed_tables(effect: float, pairs: int) -> None:
    # paired t-test, two-sided 5 %, power 80 %: Faul and others, Behavior Research Methods 39 (2007), program G*Power
    assert needed_for_mean(effect, 1.0) == pairs
    assert needed_for_mean(-effect, 1.0) == pairs


def test_power_of_mcnemars_exact_test_is_the_published_one() -> None:
    # S. W. Duffy, Statistics in Medicine 3 (1984), as the tests of the R package MESS have it: 144 pairs
    assert round(rate_power(144, 0.25, 0.45), 2) == 0.80
    assert rate_power(144, 0.45, 0.25) == rate_power(144, 0.25, 0.45)


@pytest.mark.parametrize(
    ("lost", "gained", "connor"),
    # Connor's 22.8, as of powerandsamplesize.com, and 155 of another calculator; exact tests want a few more
    [(0.05, 0.45, 23), (0.15, 0.3, 155)],
)
def test_pairs_for_a_rate_are_a_few_more_than_connors(lost: float, gained: float, connor: int) -> None:
    found = needed_for_rate(lost, gained)
    assert found is not None
    assert connor <= found <= connor + 14
    assert rate_power(found, lost, gained) >= POWER > rate_power(connor - 1, lost, gained)


def test_five_turned_pairs_show_nothing_and_six_do() -> None:
    assert rate_power(5, 0.0, 1.0) == 0.0
    assert rate_power(6, 0.0, 1.0) == pytest.approx(1.0)
    assert (visible_rate(5, 0.5), visible_mean(1, 1.0), visible_mean(9, 0.0)) == (None, None, None)
    assert (needed_for_rate(0.1, 0.1), needed_for_mean(0.0, 1.0)) == (None, None)
    assert (needed_for_rate(0.1, 0.1001), needed_for_mean(1e-6, 1.0)) == (None, None)
    assert rate_power(50, 0.0, 0.0) == 0.0


@settings(max_examples=25)
@given(pairs=st.integers(10, 120), turned=st.floats(0.02, 1.0))
def test_visible_rate_is_the_smallest_with_the_power(pairs: int, turned: float) -> None:
    found = visible_rate(pairs, turned)
    assert found is not None
    both = max(turned, found)
    assert rate_power(pairs, (both - found) / 2.0, (both + found) / 2.0) >= POWER
    less = max(0.0, found - 1e-3)
    both = max(turned, less)
    assert rate_power(pairs, (both - less) / 2.0, (both + less) / 2.0) < POWER


@given(pairs=st.integers(3, 5_000), deviation=st.floats(0.01, 10.0))
def test_number_for_a_mean_and_what_it_shows_are_inverse(pairs: int, deviation: float) -> None:
    difference = visible_mean(pairs, deviation)
    assert difference is not None
    found = needed_for_mean(difference * (1.0 + 1e-9), deviation)
    assert found == pairs


@pytest.mark.slow
def test_verdicts_test_finds_a_visible_mean_in_80_percent_of_experiments() -> None:
    rng, pairs = np.random.default_rng(1), 40
    difference = visible_mean(pairs, 1.0)
    assert difference is not None
    samples = rng.normal(-difference, 1.0, (600, pairs))
    found = float(np.mean([flip_chance(each) <= LEVEL for each in samples]))
    assert found == pytest.approx(POWER, abs=3.5 * math.sqrt(0.16 / 600))


@pytest.mark.slow
def test_verdicts_test_finds_a_visible_rate_in_80_percent_of_experiments() -> None:
    rng, pairs, turned = np.random.default_rng(2), 60, 0.3
    difference = visible_rate(pairs, turned)
    assert difference is not None
    chances = [(turned + difference) / 2.0, 1.0 - turned, (turned - difference) / 2.0]
    samples = rng.choice([-1.0, 0.0, 1.0], (600, pairs), p=chances)
    found = float(np.mean([flip_chance(each) <= LEVEL for each in samples]))
    assert found == pytest.approx(POWER, abs=3.5 * math.sqrt(0.16 / 600))
