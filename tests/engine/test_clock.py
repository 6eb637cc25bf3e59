from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.engine.clock import Cadence, Clock, nanoseconds, seconds
from cellwright.util.errors import UsageError

timesteps = st.sampled_from([Fraction(1, 500), Fraction(1, 240), Fraction(1, 1000), Fraction(1, 3), Fraction(7, 1000)])


@given(timesteps, st.integers(0, 10**7))
def test_clock_time_is_rounded_product_of_tick_and_timestep(timestep: Fraction, tick: int) -> None:
    clock = Clock(timestep)
    clock.set_tick(tick)
    assert abs(clock.now - tick * 10**9 * timestep) <= Fraction(1, 2)


@given(timesteps)
def test_clock_advance_equals_set_tick(timestep: Fraction) -> None:
    walked, set_ = Clock(timestep), Clock(timestep)
    for tick in range(1, 1000):
        set_.set_tick(tick)
        assert walked.advance() == set_.now == walked.now


@given(timesteps, st.integers(0, 10**9), st.integers(0, 40), st.integers(-(10**18), 10**18))
def test_times_are_times_of_ticks(timestep: Fraction, tick: int, count: int, ahead: int) -> None:
    clock = Clock(timestep)
    assert clock.times(tick, count, ahead) == [clock.time_of(each) + ahead for each in range(tick, tick + count)]


@given(timesteps, st.integers(0, 10**12))
def test_first_tick_at_is_first_tick_not_before_time(timestep: Fraction, time: int) -> None:
    clock = Clock(timestep)
    tick = clock.first_tick_at(time)
    assert clock.time_of(tick) >= time
    assert tick == 0 or clock.time_of(tick - 1) < time


@given(st.sampled_from([Fraction(1, 100), Fraction(1, 3), Fraction(1, 20), Fraction(7, 11)]), st.integers(0, 10**12))
def test_cadence_first_at_is_first_sample_not_before_time(period: Fraction, time: int) -> None:
    cadence = Cadence(period)
    index = cadence.first_at(time)
    assert cadence.due(index) >= time
    assert index == 0 or cadence.due(index - 1) < time


def test_seconds_and_nanoseconds_are_converted() -> None:
    assert nanoseconds(0.1) == 100_000_000
    assert nanoseconds(Fraction(1, 3)) == 333_333_333
    assert seconds(2_500_000_000) == 2.5


def test_timestep_and_period_not_above_zero_are_refused() -> None:
    with pytest.raises(UsageError, match="timestep"):
        Clock(Fraction(0))
    with pytest.raises(UsageError, match="period"):
        Cadence(Fraction(-1))
