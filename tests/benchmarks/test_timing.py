"""Best of repeats, and percentiles."""

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.timing import best_in_turn, percentile, processor_time


def test_best_in_turn_interleaves_repeats_and_returns_minimum() -> None:
    order: list[str] = []

    def work(name: str, times: list[float]) -> Callable[[], float]:
        left = iter(times)

        def once() -> float:
            order.append(name)
            return next(left)

        return once

    assert best_in_turn(3, work("a", [3.0, 1.0, 2.0]), work("b", [5.0, 6.0, 4.0])) == [1.0, 4.0]
    assert "".join(order) == "ababab"


def test_processor_time_runs_work_once() -> None:
    done: list[int] = []
    assert processor_time(lambda: done.extend(range(1000))) >= 0.0
    assert len(done) == 1000


@pytest.mark.slow
@given(st.lists(st.floats(0.0, 1e6), min_size=2, max_size=20), st.integers(1, 98))
def test_percentiles_rise_and_stay_in_range(times: list[float], percent: int) -> None:
    lower, upper = percentile(times, percent), percentile(times, percent + 1)
    assert min(times) - 1e-6 <= lower <= upper + 1e-6 <= max(times) + 2e-6
    assert percentile([1.0, 3.0], 50) == pytest.approx(2.0)
