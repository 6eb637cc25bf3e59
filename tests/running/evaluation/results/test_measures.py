"""Tests of time and placement: which runs and parts count, and their statistics and changes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.running.evaluation.results.comparison import Comparison
from cellwright.running.evaluation.results.measures import MEASURES, changes, statistics
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.summary import measure_rows, summarize
from tests.running.evaluation.made_results import CRASHED, KIT, LOST, MISSING, PART, SCORE, result, worked


def placed(*distances: float, seed: int = 1, time: float = 20.0, **changes: Any) -> Result:
    """Return the result of a run that placed parts at these distances [m]."""
    parts = [{**PART, "distance": each, "yaw_difference": 2.0 * each, **changes} for each in distances]
    orders = [{"order_id": "order_0", "kits": [{**KIT, "parts": [*parts, MISSING]}]}]
    return worked(seed=seed, simulated=time, score={**SCORE, "orders": orders})


def test_statistics_are_of_done_runs_and_submitted_parts() -> None:
    runs = [placed(0.001, 0.003, time=10.0), placed(0.004, seed=2, time=14.0), replace(CRASHED, score={}), LOST]
    found = statistics(runs, are_sample=True)
    assert list(found) == [measure.name for measure in MEASURES]
    time, distance, yaw = found.values()
    assert (time.runs, time.mean, distance.runs) == (2, 12.0, 2)
    assert time.deviation == pytest.approx(2.0**1.5)
    assert distance.mean == pytest.approx(0.003)  # of means of runs, 2 and 4 mm
    assert distance.deviation == pytest.approx(0.0015275, abs=1e-7)  # of 1, 3 and 4 mm
    low, high = distance.interval or (1.0, 1.0)
    assert low == 0.0  # no distance is negative
    assert high == pytest.approx(0.003 + 12.7062 * 0.001, rel=1e-4)
    low, high = statistics([placed(0.1), placed(0.102, seed=2)], are_sample=True)["distance"].interval or (0.0, 0.0)
    assert (low + high) / 2.0 == pytest.approx(0.101)
    assert high - low == pytest.approx(2.0 * 12.7062 * 0.001, rel=1e-4)
    assert yaw.mean == pytest.approx(2.0 * distance.mean)


def test_parts_whose_place_is_off_the_tray_have_no_error() -> None:
    assert "distance" not in statistics([placed(0.5, reachable_pose=0.0)], are_sample=True)


def test_runs_that_are_one_have_no_interval_but_a_spread_of_parts() -> None:
    (summary,) = summarize([placed(0.001, 0.003), placed(0.001, 0.003, seed=2)])
    assert summary.measures["distance"].interval is None
    rows = measure_rows([summary])
    assert rows[1] == ["tiny", "off, mm", "2", "-", "1.15"]
    assert measure_rows(summarize([LOST])) == []
    assert [row[4] for row in measure_rows(summarize([placed(0.002)]))] == ["-", "-", "-"]


def test_changes_are_those_of_pairs_that_both_have_the_measure() -> None:
    pairs = [
        (placed(0.004, time=20.0), placed(0.002, time=18.0)),
        (placed(0.005, time=22.0), placed(0.002, time=19.0)),
        (placed(0.009, time=99.0), LOST),
    ]
    found = changes(pairs, are_sample=True)
    assert (found["time"].pairs, found["time"].before, found["time"].difference) == (2, 21.0, -2.5)
    assert found["distance"].difference == pytest.approx(-0.0025)
    assert changes([(LOST, LOST)], are_sample=True) == {}


@given(distances=st.lists(st.floats(1e-6, 0.03), min_size=2, max_size=8))
def test_two_versions_with_all_points_differ_in_their_measures(distances: list[float]) -> None:
    before = [placed(each, seed=seed, time=20.0 + each) for seed, each in enumerate(distances)]
    after = [placed(each / 2.0, seed=seed, time=20.0 + each) for seed, each in enumerate(distances)]
    found = Comparison.of(before, after)
    assert found.difference == 0.0
    (trial,) = found.trials()
    assert trial.measures["distance"].difference == pytest.approx(-sum(distances) / len(distances) / 2.0)
    assert trial.measures["time"].difference == pytest.approx(0.0, abs=1e-9)


def test_result_without_parts_has_time_alone() -> None:
    assert list(statistics([result()], are_sample=True)) == ["time"]
