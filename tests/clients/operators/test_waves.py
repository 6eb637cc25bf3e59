"""Test signals: their values, and their limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.operators.exercise import Wave, WaveShape
from cellwright.util.errors import UsageError

waves = st.builds(
    Wave,
    shape=st.sampled_from(WaveShape),
    amplitude=st.floats(-3.0, 3.0).filter(lambda value: abs(value) > 1e-3),
    frequency=st.floats(0.05, 20.0),
    periods=st.integers(1, 20),
)


@given(wave=waves, part=st.floats(-0.5, 1.5))
def test_wave_stays_in_range_and_is_0_before_and_after(wave: Wave, part: float) -> None:
    low, high = wave.offset_range
    offset = wave.offset(part * wave.duration)
    assert low - 1e-12 <= offset <= high + 1e-12
    if part < 0.0 or part > 1.0:
        assert offset == 0.0


@given(wave=waves)
def test_wave_reaches_amplitude_on_first_side(wave: Wave) -> None:
    period = 1 / wave.frequency
    offsets = np.array([wave.offset(time) for time in np.linspace(0.0, period, 401)[:-1]])
    away = offsets[np.flatnonzero(np.abs(offsets) > 1e-9)[0]]
    assert math.copysign(1.0, away) == math.copysign(1.0, wave.amplitude)
    assert np.abs(offsets).max() == pytest.approx(abs(wave.amplitude), rel=1e-3)
    assert wave.offset(0.0) == 0.0


@given(wave=waves.filter(lambda wave: wave.shape is not WaveShape.STEP), part=st.floats(0.0, 0.999))
def test_wave_speed_is_upper_bound(wave: Wave, part: float) -> None:
    begin = part * wave.duration
    moved = abs(wave.offset(begin + 1e-4 * wave.duration) - wave.offset(begin))
    assert moved <= wave.speed * 1e-4 * wave.duration * (1 + 1e-6) + 1e-9


def test_step_wave_is_0_for_first_half_period() -> None:
    wave = Wave(WaveShape.STEP, -0.2, 0.5, 2)
    assert [wave.offset(time) for time in (0.0, 0.99, 1.01, 1.99, 2.01, 3.01, 4.01)] == [0, 0, -0.2, -0.2, 0, -0.2, 0]
    assert wave.speed == math.inf


@pytest.mark.parametrize(("duration", "periods"), [(4.0, 2), (0.1, 1), (5.1, 3)])
def test_wave_lasts_whole_periods(duration: float, periods: int) -> None:
    wave = Wave.lasting(WaveShape.SINE, 0.1, 0.5, duration)
    assert (wave.periods, wave.duration) == (periods, 2.0 * periods)


@pytest.mark.parametrize(
    ("numbers", "reason"),
    [
        ((0.0, 0.5, 4.0), "amplitude must not be 0"),
        ((math.nan, 0.5, 4.0), "amplitude"),
        ((math.inf, 0.5, 4.0), "amplitude"),
        ((0.1, 0.0, 4.0), "frequency must be above 0"),
        ((0.1, 51.0, 4.0), "at most 50 Hz"),
        ((0.1, math.nan, 4.0), "frequency"),
        ((0.1, 0.5, 0.0), "duration must be above 0"),
        ((0.1, 0.5, 1e5), "duration"),
        ((0.1, 1e-5, 4.0), "a period of 100000 s is longer"),
    ],
)
def test_invalid_wave_parameters_are_refused(numbers: tuple[float, float, float], reason: str) -> None:
    with pytest.raises(UsageError, match=reason):
        Wave.lasting(WaveShape.SINE, *numbers)
