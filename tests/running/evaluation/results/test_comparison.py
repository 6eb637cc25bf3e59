"""Tests of comparisons: pairs, figures, the verdict, and what pairs gain over separate means."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.running.evaluation.results.comparison import Comparison, overall, read_evaluation
from cellwright.running.evaluation.results.intervals import mean_interval, student_quantile
from cellwright.running.evaluation.results.power import needed_for_rate, visible_rate
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.summary import summary_document
from cellwright.running.evaluation.results.verdict import Verdict
from cellwright.util.errors import UsageError
from tests.running.evaluation.made_results import CRASHED, LOST, result, worked


def runs(points: list[float], **changes: object) -> list[Result]:
    return [result(each, seed=seed, **changes) for seed, each in enumerate(points, start=1)]


def verdict(before: list[Result], after: list[Result], margin: float = 0.0) -> Verdict:
    return overall(Comparison.of(before, after).judgements(margin))


def test_runs_are_paired_by_trial_and_seed() -> None:
    before = [*runs([6.0, 8.0, 9.0]), result(1.0, trial="alone")]
    after = [*reversed(runs([9.0, 8.0])), result(1.0, trial="other"), result(5.0, seed=3, vary=True)]
    found = Comparison.of(before, after)
    assert [(pair.before.seed, pair.difference) for pair in found.pairs] == [(1, 3.0), (2, 0.0)]
    assert found.unpaired == (2, 2)
    assert found.difference == pytest.approx(1.5 / 12.0)
    (trial,) = found.trials()
    assert (trial.pairs, trial.before, trial.after, trial.better, trial.worse) == (2, 7.0, 8.5, 1, 0)


def test_turned_runs_come_worst_first() -> None:
    before = [result(9.0), CRASHED, result(6.0, seed=4), result(6.0, seed=5)]
    after = [result(12.0), replace(CRASHED, outcome="done"), result(6.0, seed=4), replace(LOST, seed=5)]
    turned = Comparison.of(before, after).turned
    assert [(pair.before.seed, pair.difference) for pair in turned] == [(5, -6.0), (2, 0.0), (1, 3.0)]


def test_loss_beyond_margin_is_regression() -> None:
    before, after = runs([9.0, 10.0, 8.0, 9.0, 11.0] * 4), runs([8.0, 9.0, 7.0, 8.5, 9.5] * 4)
    found = Comparison.of(before, after)
    low, high = found.interval or (0.0, 0.0)
    assert found.difference == pytest.approx(-1 / 12.0)
    assert low < found.difference < high < 0.0
    assert verdict(before, after) is Verdict.WORSE
    assert verdict(before, after, -high - 0.01) is Verdict.WORSE
    assert verdict(before, after, -low + 0.01) is Verdict.NOT_WORSE
    assert verdict(after, before) is Verdict.BETTER
    assert verdict(before, before) is Verdict.NOT_WORSE


def test_loss_within_noise_is_inconclusive() -> None:
    before, after = runs([9.0, 10.0, 8.0, 9.0]), runs([8.0, 11.0, 4.0, 9.0])
    assert verdict(before, after) is Verdict.INCONCLUSIVE


def test_clear_loss_of_four_varied_runs_is_worse_and_of_fewer_inconclusive() -> None:
    before = runs([6.0, 6.0, 6.0, 6.0], reachable=6.0, vary=True)
    after = runs([4.0, 0.0, 4.0, 4.0], reachable=6.0, vary=True)
    after[1] = replace(after[1], outcome="crashed", reason="ValueError: no part")
    found = [verdict(before[:count], after[:count]) for count in range(1, 5)]
    assert found == [Verdict.INCONCLUSIVE] * 3 + [Verdict.WORSE]


def test_runs_that_crash_with_the_same_points_are_worse() -> None:
    before = runs([6.0] * 8, vary=True)
    assert verdict(before, [replace(each, outcome="crashed", reason="late") for each in before]) is Verdict.WORSE
    lost = [replace(each, outcome="crashed", reason="late") for each in before[:1]]
    assert verdict(before, [*lost, *before[1:]]) is Verdict.INCONCLUSIVE


def test_single_run_of_one_trial_leaves_the_others_a_sample() -> None:
    before = [*runs([9.0, 10.0, 8.0], vary=True), result(9.0, trial="alone", vary=True)]
    after = [*runs([8.0, 11.0, 7.0], vary=True), result(9.0, trial="alone", vary=True)]
    assert verdict(before, after) is Verdict.INCONCLUSIVE


def test_pairs_without_chance_count_exactly() -> None:
    before, after = [worked(3.0), worked(3.0, seed=2)], [worked(2.0), worked(2.0, seed=2)]
    found = Comparison.of(before, after)
    assert (found.interval, found.trials()[0].interval) == (None, None)
    assert verdict(before, after) is Verdict.WORSE
    assert verdict(before, after, 0.1) is Verdict.NOT_WORSE
    assert verdict(before[:1], after[:1]) is Verdict.WORSE


def test_crash_at_the_same_time_of_every_seed_is_exact() -> None:
    before = [worked(3.0), worked(3.0, seed=2)]
    after = [replace(CRASHED, seed=seed) for seed in (1, 2)]
    after = [replace(each, trial=before[0].trial, reachable=before[0].reachable) for each in after]
    assert verdict(before, after) is Verdict.WORSE
    assert verdict(before, [after[0], replace(after[1], simulated=1.5)]) is Verdict.INCONCLUSIVE


def swept(shares: list[float], values: int, reachable: float = 12.0) -> list[Result]:
    """Return runs of a sweep in which a seed has the same share of the points with each value."""
    return [
        result(share * reachable, trial=f"tiny friction={value}", seed=seed, reachable=reachable, vary=True)
        for value in range(values)
        for seed, share in enumerate(shares, start=1)
    ]


def test_values_of_a_sweep_are_no_further_draws_of_a_seed() -> None:
    before, after = [0.5, 0.6, 0.7, 0.5, 0.6], [0.4, 0.65, 0.5, 0.45, 0.6]
    alone, five = (Comparison.of(swept(before, values), swept(after, values)) for values in (1, 5))
    assert five.difference == pytest.approx(alone.difference)
    assert five.interval == pytest.approx(alone.interval or ())
    for name, judgement in alone.judgements(0.01).items():
        found = five.judgements(0.01)[name]
        assert found.verdict is judgement.verdict
        assert found.chance == pytest.approx(judgement.chance)
    assert five.more_seeds(0.0) == alone.more_seeds(0.0)
    assert five.power()["points"].visible == pytest.approx(alone.power()["points"].visible)


def test_power_of_runs_done_is_that_of_the_pairs_that_turned() -> None:
    before = runs([6.0] * 20, vary=True)
    after = [replace(each, outcome="crashed", reason="late") if each.seed <= 4 else each for each in before]
    found = Comparison.of(before, after).power()
    assert found["runs done"].needed == needed_for_rate(0.2, 0.0)
    assert found["runs done"].visible[20] == visible_rate(20, 0.2)
    # equal points show no spread, so nothing is known of it
    assert (found["points"].needed, set(found["points"].visible.values())) == (None, {None})
    assert Comparison.of([worked(3.0), worked(3.0, seed=2)], [worked(2.0), worked(2.0, seed=2)]).power() == {}


def test_evaluations_that_cannot_be_paired_are_refused() -> None:
    with pytest.raises(UsageError, match="no run in common; evaluate"):
        Comparison.of([result(seed=1)], [result(seed=2)])
    with pytest.raises(UsageError, match=r"tiny: the attainable points differ \(got 12 and 8\)"):
        Comparison.of([result()], [result(reachable=8.0)])


@settings(max_examples=25)
@given(points=st.lists(st.tuples(st.floats(0.0, 12.0), st.floats(0.0, 12.0)), min_size=2, max_size=20))
def test_comparison_the_other_way_has_opposite_figures(points: list[tuple[float, float]]) -> None:
    before, after = (runs([pair[side] for pair in points]) for side in (0, 1))
    there, back = Comparison.of(before, after), Comparison.of(after, before)
    assert there.difference == pytest.approx(-back.difference)
    assert there.interval is not None
    assert back.interval is not None
    assert there.interval == pytest.approx((-back.interval[1], -back.interval[0]))
    assert -1.0 <= there.interval[0] <= there.interval[1] <= 1.0
    assert not all(overall(each.judgements(0.0)) is Verdict.WORSE for each in (there, back))
    json.dumps(there.as_json(0.0), allow_nan=False)


def test_evaluation_is_read_from_its_folder_or_file(tmp_path: Path) -> None:
    results = [worked(), CRASHED, LOST]
    file = tmp_path / "summary.json"
    file.write_text(json.dumps(summary_document(results, None, 1)))
    assert read_evaluation(tmp_path) == read_evaluation(file) == results


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("no json", "not a summary of an evaluation: Expecting value"),
        ("[" * 100_000, "not a summary of an evaluation: "),
        ("[]", "not a summary of an evaluation; give the folder"),
        ('{"results": [3]}', "not a summary of an evaluation; give the folder"),
        ('{"results": [{"points": 3}]}', "not a result of this version of Cellwright; repeat the evaluation"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "summary.json").write_text(text)
    with pytest.raises(UsageError, match=rf"summary\.json: {message}"):
        read_evaluation(tmp_path)


def test_folder_without_evaluation_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"summary\.json: cannot be read: .*; give the folder of an evaluation"):
        read_evaluation(tmp_path)


def test_name_that_no_folder_can_have_is_refused() -> None:
    with pytest.raises(UsageError, match=r"n: cannot be read: .*; give the folder of an evaluation"):
        read_evaluation(Path("n" * 300))


Samples: TypeAlias = "np.ndarray[tuple[int, ...], np.dtype[np.float64]]"
EXPERIMENTS = 2_000
SEEDS = 16


def scores(rng: np.random.Generator, count: int, gain: float, seeds: Samples | None = None) -> Samples:
    """Return percentages of a program; seeds, shared or its own, make three quarters of their variance."""
    own = seeds if seeds is not None else rng.normal(60.0, 8.66, (EXPERIMENTS, count))
    return own + gain + rng.normal(0.0, 5.0, own.shape)


@pytest.mark.slow
def test_pairs_find_five_points_with_half_the_seeds_of_separate_means() -> None:
    rng = np.random.default_rng(1)
    seeds = rng.normal(60.0, 8.66, (EXPERIMENTS, SEEDS))
    differences = scores(rng, SEEDS, 5.0, seeds) - scores(rng, SEEDS, 0.0, seeds)
    ends = np.array([mean_interval([each]) for each in differences.tolist()])
    paired = float(np.mean(ends[:, 0] > 0.0))
    separate = {}
    for factor in (1, 2):
        count = factor * SEEDS
        first, second = scores(rng, count, 0.0), scores(rng, count, 5.0)
        error = np.sqrt((first.var(axis=1, ddof=1) + second.var(axis=1, ddof=1)) / count)
        gain = second.mean(axis=1) - first.mean(axis=1)
        separate[factor] = float(np.mean(gain > student_quantile(2 * count - 2) * error))
    assert paired >= 0.7, paired
    assert paired > separate[2] + 0.1 > separate[1], separate


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "count", "least"),
    [
        *[("normal", count, 0.93) for count in (5, 20, 100)],
        *[("steps", count, 0.93) for count in (20, 100)],
        ("steps", 5, 0.89),  # one in ten experiments shows no variance, or next to none
    ],
)
def test_intervals_of_differences_contain_the_true_one_in_95_percent_of_experiments(
    kind: str, count: int, least: float
) -> None:
    rng = np.random.default_rng(count)
    if kind == "normal":
        differences, truth = rng.normal(-1.0, 2.0, (10_000, count)), -1.0
    else:  # whole steps: down, none, up
        differences = rng.choice([-2.0, 0.0, 2.0], (10_000, count), p=[0.4, 0.35, 0.25])
        truth = -0.3
    ends = np.array([mean_interval([each]) for each in differences.tolist()])
    found = float(np.mean((ends[:, 0] <= truth) & (truth <= ends[:, 1])))
    assert least <= found <= 0.97, found
