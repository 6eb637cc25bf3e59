"""Tests of the summary of results."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.running.evaluation.plan.job import repeated_key
from cellwright.running.evaluation.results.result import Result, ResultError
from cellwright.running.evaluation.results.summary import (
    Repeat,
    Threshold,
    are_same,
    mean_share,
    passed_count,
    passed_interval,
    range_text,
    real_time_factor,
    share_interval,
    shortcoming,
    summarize,
    summary_document,
    with_interval,
    with_repeats,
    worst_first,
)
from cellwright.util.errors import UsageError
from tests.running.evaluation.made_results import CRASHED, LOST, result, worked


@pytest.mark.parametrize(
    ("text", "points", "reached"),
    [("8", 8.0, True), ("8", 7.9, False), ("75%", 9.0, True), ("75 %", 8.9, False), ("-1", 0.0, True), ("0%", 0, True)],
)
def test_threshold_is_reached_by_points_or_share(text: str, points: float, reached: bool) -> None:
    assert Threshold.read(text).is_reached(result(points)) == reached


@pytest.mark.parametrize("text", ["", "%", "much", "nan", "inf%", "8 points"])
def test_invalid_thresholds_are_refused(text: str) -> None:
    with pytest.raises(UsageError, match="or a share of the attainable points"):
        Threshold.read(text)


NO_ORDER = result(0.0, trial="empty", reachable=0.0, outcome="no_order", reason="the trial has no order")


def test_run_without_points_to_earn_is_no_pass_and_has_no_share() -> None:
    done = result(0.0, reachable=0.0)
    assert (done.share, done.is_unjudged, NO_ORDER.is_unjudged) == (0.0, True, True)
    assert shortcoming(done, None) == "no point can be earned in this trial"
    assert shortcoming(NO_ORDER, Threshold.read("0")) == "the trial has no order"
    assert not result(0.0, reachable=0.0, outcome="crashed").is_unjudged


def test_runs_without_points_to_earn_count_in_no_share_and_no_interval() -> None:
    judged = [result(6.0, seed=1), result(3.0, seed=2, simulated=9.0)]
    mixed = [*judged, NO_ORDER]
    assert mean_share(mixed) == mean_share(judged)
    assert passed_count(mixed, None) == (2, 2)
    assert share_interval(mixed) == share_interval(judged)
    assert passed_interval(mixed, None) == passed_interval(judged, None)
    assert [each.share for each in summarize(mixed)][1] is None
    assert mean_share([NO_ORDER]) is None


def test_shortcoming_gives_the_reason() -> None:
    half = Threshold.read("50%")
    assert shortcoming(result(6.0), half) == ""
    assert shortcoming(result(0.0), None) == ""
    assert shortcoming(result(5.0), half) == "5 of 12 points, below the required 50 % of the points"
    assert shortcoming(result(5.0), Threshold.read("5.5")) == "5 of 12 points, below the required 5.5 points"
    assert shortcoming(LOST, None) == "still running after 5 s"
    assert shortcoming(result(12.0, outcome="time_limit", reason="time limit"), half) == "time limit"


def test_summarize_gives_figures_per_trial() -> None:
    first, second = summarize([result(12.0), result(6.0, seed=2), LOST, result(1.0, trial="other", reachable=2.0)])
    assert (first.trial, first.runs, first.mean, first.min, first.max, first.reachable) == (
        "tiny",
        3,
        6.0,
        0.0,
        12.0,
        12.0,
    )
    assert first.share == pytest.approx(0.5)
    assert first.outcomes == {"done": 2, "wall_limit": 1}
    assert first.real_time_factor == pytest.approx(10.0)
    assert (second.trial, second.share, second.best) == ("other", 0.5, 15.0)
    assert summarize([]) == []
    assert real_time_factor([LOST]) == 0.0


def test_summaries_have_intervals_of_means_and_rates() -> None:
    results = [result(6.0 + seed % 3, seed=seed) for seed in range(12)]
    (summary,) = summarize(results, Threshold.read("7"))
    assert summary.mean_interval == pytest.approx((6.4, 7.5), abs=0.2)
    assert summary.share_interval == pytest.approx([end / 12.0 for end in summary.mean_interval or ()])
    assert (summary.done, summary.passed) == (12, 8)
    assert summary.passed_interval == pytest.approx((0.391, 0.862), abs=1e-3)
    assert passed_interval(results, Threshold.read("7")) == summary.passed_interval
    assert share_interval(results) == summary.share_interval
    assert share_interval([*results, result(trial="alone")]) is None
    document = json.loads(json.dumps(summary_document(results, None, 0), allow_nan=False))
    assert document["trials"][0]["mean_interval"] == list(summary.mean_interval or ())
    assert document["share_interval"] == list(summary.share_interval or ())


def test_same_runs_of_a_trial_without_chance_are_no_sample() -> None:
    same = [worked(seed=1), worked(seed=2)]
    assert are_same(same)
    assert not are_same([worked()])
    assert not are_same([worked(), worked(seed=2, simulated=20.002)])
    assert not are_same([LOST, LOST])
    (summary,) = summarize(same)
    assert summary.mean_interval is summary.passed_interval is summary.share_interval is None
    assert share_interval(same) is None
    assert passed_interval(same, None) is None
    document = summary_document(same, None, 0)
    assert document["share"] == pytest.approx(1 / 6)
    assert document["share_interval"] is None


@pytest.mark.parametrize(
    ("second", "difference"),
    [
        ({}, ""),
        ({"wall": 9.0, "key": "other"}, ""),
        ({"state_hash": "b" * 64}, "state aaaaaaaa, then bbbbbbbb"),
        ({"state_hash": "b" * 64, "points": 3.0}, "12, then 3 points; state aaaaaaaa, then bbbbbbbb"),
        ({"outcome": "wall_limit", "state_hash": ""}, "done, then wall limit"),
    ],
)
def test_repeat_says_how_runs_differ(second: dict[str, Any], difference: str) -> None:
    first = result(state_hash="a" * 64)
    repeat = Repeat(first, replace(first, **second))
    assert repeat.difference == difference
    assert repeat.as_json()["difference"] == difference
    assert Repeat(LOST, LOST).difference == ""


def test_interval_as_text() -> None:
    assert with_interval("8 of 10 runs", (0.4902, 0.9433)) == "8 of 10 runs (95 %: 49 to 94.3 %)"
    assert with_interval("1 of 1 runs", None) == "1 of 1 runs"
    assert (range_text((4.111, 12.0)), range_text(None)) == ("4.11 to 12", "-")


@pytest.mark.slow
@given(points=st.lists(st.floats(min_value=0.0, max_value=12.0), min_size=1, max_size=30))
def test_mean_of_summary_lies_between_min_and_max(points: list[float]) -> None:
    (summary,) = summarize([result(each, seed=seed) for seed, each in enumerate(points)])
    assert summary.min <= summary.mean + 1e-9
    assert summary.mean <= summary.max + 1e-9
    assert summary.share == pytest.approx(summary.mean / 12.0)
    assert sum(summary.outcomes.values()) == len(points)


def test_worst_first_orders_lost_before_low_scores() -> None:
    results = [result(12.0), CRASHED, result(3.0, seed=5), LOST]
    assert worst_first(results) == [LOST, CRASHED, results[2], results[0]]


def test_summary_document_is_json_with_all_fields() -> None:
    document = json.loads(json.dumps(summary_document([worked(), LOST], Threshold.read("75%"), 1), allow_nan=False))
    assert (document["exit_status"], document["runs"], document["passed"]) == (1, 2, 0)
    assert document["min_score"] == "75 % of the points"
    assert document["trials"][0]["outcomes"] == {"done": 1, "wall_limit": 1}
    assert [each["shortcoming"] for each in document["results"]] == [
        "2 of 12 points, below the required 75 % of the points",
        "still running after 5 s",
    ]
    assert document["results"][0]["score"]["orders"][0]["kits"][0]["bonus"] == "parts short"
    assert document["versions"]["cellwright"]


def test_result_survives_json() -> None:
    for each in (worked(), CRASHED, LOST):
        assert Result.from_json(json.loads(json.dumps(each.as_json()))) == each
    wrongs: list[object] = [None, [], {}, {**LOST.as_json(), "more": 1}]
    for wrong in wrongs:
        with pytest.raises(ResultError):
            Result.from_json(wrong)


def test_result_has_name_and_ending_in_words() -> None:
    assert (LOST.name, LOST.ending, LOST.is_lost, LOST.is_done) == ("tiny seed 3", "lost: wall limit", True, False)
    assert (CRASHED.ending, CRASHED.is_lost) == ("the agent crashed", False)


@given(st.lists(st.sampled_from(("run", "repetition", "both")), max_size=6), st.randoms())
def test_runs_and_repetitions_are_distinguished_in_any_order(kinds: list[str], chance: Any) -> None:
    runs = [replace(LOST, key=f"key{number}") for number in range(len(kinds))]
    seconds = [replace(each, key=repeated_key(each.key), points=1.0) for each in runs]
    ended = [run for run, kind in zip(runs, kinds, strict=True) if kind != "repetition"]
    ended += [second for second, kind in zip(seconds, kinds, strict=True) if kind != "run"]
    chance.shuffle(ended)
    results, repeats = with_repeats(ended)
    assert len(results) == len(kinds)
    assert {each.key for each in results} == {
        second.key if kind == "repetition" else run.key for run, second, kind in zip(runs, seconds, kinds, strict=True)
    }
    assert {(each.first.key, each.second.key) for each in repeats} == {
        (run.key, second.key) for run, second, kind in zip(runs, seconds, kinds, strict=True) if kind == "both"
    }
