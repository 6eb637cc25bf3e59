"""Estimate of the node's clock."""

import pytest

from cellwright.viewer.web.operator.worker import NodeClock


@pytest.mark.parametrize("rate", [0.0, 0.5, 1.0, 10.0])
def test_it_goes_as_fast_as_it_went(rate: float) -> None:
    clock = NodeClock()
    for step in range(5):
        clock.hear(round(rate * step * 0.05 * 1e9), 7.0 + step * 0.05)
    assert clock.at(7.2 + 0.02) == pytest.approx((0.2 + 0.02) * rate * 1e9, abs=10)


def test_the_time_is_zero_before_the_first_reading() -> None:
    clock = NodeClock()
    assert clock.at(5.0) == 0
    clock.hear(1_000, 5.0)
    assert clock.at(5.0) == 1_000
    assert clock.at(100.0) <= 1_000 + 0.25e9, "one that is not heard of may stand"


def test_a_reset_clock_is_accepted() -> None:
    clock = NodeClock()
    clock.hear(10_000_000_000, 5.0)
    clock.hear(0, 5.1)
    assert clock.at(5.11) == 0
