"""Tests of the verdict on pairs: exact chances, what few pairs show, and that no further loss makes it milder."""

from __future__ import annotations

from itertools import product
from typing import TypeAlias

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.running.evaluation.results import verdict
from cellwright.running.evaluation.results.verdict import (
    LEVEL,
    Verdict,
    deal_chance,
    flip_chance,
    judge,
    loss_chance,
    more_pairs,
)

FULL_AND_LOSSES = [(1.0, 4 / 6), (1.0, 0.0), (1.0, 4 / 6), (1.0, 4 / 6)]
"""Four runs of 6, 6, 6, 6 points against 4, a crash, 4 and 4."""
SIXTHS = st.integers(0, 6).map(lambda points: points / 6)
PAIRS = st.lists(st.tuples(SIXTHS, SIXTHS), min_size=1, max_size=12)


def test_clear_loss_of_four_runs_is_worse() -> None:
    found = judge(FULL_AND_LOSSES, [], 0.0)
    assert found.verdict is Verdict.WORSE
    assert found.chance == pytest.approx(1 / 70)


def test_losses_never_become_milder_with_more_seeds() -> None:
    losses = FULL_AND_LOSSES * 5
    verdicts = [judge(losses[:count], [], 0.0).verdict for count in range(1, len(losses) + 1)]
    assert verdicts[:3] == [Verdict.INCONCLUSIVE] * 3
    assert set(verdicts[3:]) == {Verdict.WORSE}


@given(pairs=PAIRS, lost=SIXTHS.filter(bool), margin=st.sampled_from([0.0, 0.02, 0.1]))
def test_further_loss_turns_no_verdict_milder(pairs: list[tuple[float, float]], lost: float, margin: float) -> None:
    order = list(Verdict)
    before = judge(pairs, [], margin).verdict
    after = judge([*pairs, (lost, 0.0)], [], margin).verdict
    assert before is not Verdict.WORSE or after in (Verdict.WORSE, Verdict.INCONCLUSIVE)
    # a fifth losing pair is dealt with the other four, and a small loss among large ones shows less than those alone
    if len(pairs) > verdict._FEW or (len(pairs) != 4 and all(second + margin < first for first, second in pairs)):
        assert order.index(after) >= order.index(before) or before is Verdict.INCONCLUSIVE
        assert before is not Verdict.WORSE or after is Verdict.WORSE


@given(pairs=PAIRS, worse=SIXTHS, number=st.integers(0, 11))
def test_larger_loss_of_one_pair_has_no_larger_chance(
    pairs: list[tuple[float, float]], worse: float, number: int
) -> None:
    before, after = np.array(pairs).T
    lower = after.copy()
    lower[number % len(pairs)] = min(lower[number % len(pairs)], worse)
    assert loss_chance(before, lower) <= loss_chance(before, after) + 1e-12


@given(st.lists(st.integers(-6, 6), min_size=1, max_size=10))
def test_chance_of_flips_is_that_of_all_combinations(differences: list[int]) -> None:
    flips = [np.dot(signs, np.abs(differences)) for signs in product((-1, 1), repeat=len(differences))]
    assert flip_chance(np.array(differences, float)) == pytest.approx(np.mean(np.array(flips) <= sum(differences)))


def test_chance_of_lost_runs_is_that_of_the_exact_sign_test() -> None:
    assert flip_chance(np.array([0.0] * 30 + [-1.0] * 6)) == pytest.approx(1 / 64)
    assert flip_chance(np.array([0.0] * 30 + [-1.0] * 7 + [1.0])) == pytest.approx(9 / 256)


def test_chance_of_many_pairs_is_close_to_the_exact_one(monkeypatch: pytest.MonkeyPatch) -> None:
    differences = np.random.default_rng(4).integers(-6, 4, 17) / 6
    close = flip_chance(differences)
    monkeypatch.setattr(verdict, "_ENUMERATED", 17)
    assert close == pytest.approx(flip_chance(differences), abs=1e-6)


def test_chance_of_deals_is_one_of_all_for_separate_runs() -> None:
    assert deal_chance(np.array([1.0, 1.0, 1.0]), np.array([0.5, 0.5, 0.0])) == pytest.approx(1 / 20)


@given(pairs=PAIRS, margin=st.sampled_from([0.0, 0.05]))
def test_both_directions_are_never_worse(pairs: list[tuple[float, float]], margin: float) -> None:
    there = judge(pairs, [], margin).verdict
    back = judge([(second, first) for first, second in pairs], [], margin).verdict
    assert {there, back} != {Verdict.WORSE}
    if there is Verdict.WORSE and margin == 0.0:
        assert back is Verdict.BETTER


def test_no_loss_is_not_worse_and_one_loss_is_inconclusive() -> None:
    assert judge([(0.5, 0.5), (0.5, 1.0)], [], 0.0).verdict is Verdict.NOT_WORSE
    assert judge([(0.5, 0.5), (0.5, 0.4)], [], 0.0).verdict is Verdict.INCONCLUSIVE
    assert judge([(0.5, 0.5), (0.5, 0.4)], [], 0.1).verdict is Verdict.NOT_WORSE


def test_gain_in_six_runs_is_better() -> None:
    assert judge([(0.5, 0.6)] * 6, [], 0.0).verdict is Verdict.BETTER


def test_rare_large_loss_counts_twice_for_the_proof_that_there_is_none() -> None:
    runs = [(1.0, 1.0)] * 29
    assert judge([*runs, (1.0, 0.0)], [], 0.1).verdict is Verdict.INCONCLUSIVE  # one of 30 may be one of ten
    assert judge([*(runs * 3), (1.0, 0.0)], [], 0.1).verdict is Verdict.NOT_WORSE


def test_differences_that_every_seed_repeats_are_exact() -> None:
    assert judge([], [-0.1, 0.0], 0.0).verdict is Verdict.WORSE
    assert judge([], [-0.1, 0.0], 0.1).verdict is Verdict.NOT_WORSE
    assert judge([], [0.1, 0.0], 0.1).verdict is Verdict.BETTER
    assert judge([(1.0, 0.9)] * 6, [0.1] * 6, 0.0).verdict is not Verdict.WORSE


@pytest.mark.parametrize("count", [2, 5, 12])
def test_stated_number_of_pairs_like_these_is_enough(count: int) -> None:
    pairs = ([(1.0, 0.8), (0.9, 1.0)] * count)[:count]
    found = judge(pairs, [], 0.0)
    assert found.verdict is Verdict.INCONCLUSIVE
    more = more_pairs(pairs, [], 0.0)
    assert more
    repeats = -(-(count + more) // count) + 1
    assert judge(pairs * repeats, [], 0.0).verdict is Verdict.WORSE


def test_no_number_of_pairs_tells_programs_without_difference_apart() -> None:
    assert more_pairs([(1.0, 0.9), (0.9, 1.0)], [], 0.0) is None


Samples: TypeAlias = "np.ndarray[tuple[int, ...], np.dtype[np.float64]]"


@pytest.mark.slow
@pytest.mark.parametrize("count", [4, 6, 12])
@pytest.mark.parametrize("kind", ["own", "seeds", "crashes", "steps"])
def test_equal_programs_are_called_worse_in_one_of_forty_experiments(kind: str, count: int) -> None:
    rng = np.random.default_rng(count)
    size = (1_000, count, 2)
    match kind:
        case "own":
            values: Samples = rng.normal(0.6, 0.1, size)
        case "seeds":
            values = rng.normal(0.6, 0.09, (*size[:2], 1)) + rng.normal(0.0, 0.05, size)
        case "crashes":
            values = (rng.random(size) > 0.3).astype(float)
        case _:
            values = rng.integers(0, 7, size) / 6
    false = np.mean([loss_chance(*pairs.T) <= LEVEL for pairs in values])
    assert false <= LEVEL + 3 * (LEVEL / size[0]) ** 0.5, false
