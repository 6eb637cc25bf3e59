"""Estimate of the node's clock."""

import pytest

from cellwright.viewer.web.operator.worker import NodeClock


@pytest.mark.parametrize("rate", [0.0, 0.5, 1.0, 10.0])
def test_node_clock_extrapolates_at_measured_rate(rate: float) -> None:
    clock = NodeClock()
    for step in range(5):
        clock.hear(round(rate * step * 0.05 * 1e9), 7.0 + step * 0.05)
    assert clock.at(7.2 + 0.02) == pytest.approx((0.2 + 0.02) * rate * 1e9, abs=10)


def test_node_clock_before_first_reading_is_zero() -> None:
    clock = NodeClock()
    assert clock.at(5.0) == 0
    clock.hear(1_000, 5.0)
    assert clock.at(5.0) == 1_000
    assert clock.at(100.0) <= 1_000 + 0.25e9, "one that is not heard of may stand"


def test_node_clock_accepts_reset() -> None:
    clock = NodeClock()
    clock.hear(10_000_000_000, 5.0)
    clock.hear(0, 5.1)
    assert clock.at(5.11) == 0
