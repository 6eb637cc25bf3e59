"""Measured real-time factor."""

from __future__ import annotations

import pytest

from cellwright.viewer.web.time_controls import SeenPace


def test_factor_before_second_reading_is_none() -> None:
    pace = SeenPace()
    assert pace.factor is None
    pace.take(0.0, 5.0)
    assert pace.factor is None
    pace.take(0.5, 6.0)
    assert pace.factor == pytest.approx(2.0)


def test_factor_ignores_old_readings() -> None:
    pace = SeenPace()
    for number in range(40):
        pace.take(number * 0.25, min(number, 20) * 0.25)
    assert pace.factor == pytest.approx(0.0)


def test_factor_after_reset_is_not_negative() -> None:
    pace = SeenPace()
    for wall, time in ((0.0, 10.0), (1.0, 11.0), (1.25, 0.0), (1.5, 0.25)):
        pace.take(wall, time)
    assert pace.factor == pytest.approx(1.0)
