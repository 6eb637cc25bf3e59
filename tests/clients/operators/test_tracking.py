"""Tracking figures, against motions of known figures."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.clients.operators.exercise import Array, Trace, delay, tracking

TIME = np.arange(0.0, 4.5, 0.01)


def sine(amplitude: float = 0.3, lag: float = 0.0, gain: float = 1.0) -> Trace:
    target = amplitude * np.sin(2 * np.pi * 0.5 * TIME)
    seen = gain * amplitude * np.sin(2 * np.pi * 0.5 * (TIME - lag))
    return Trace("elbow", TIME, target, TIME, seen)


def step(answer: Array) -> Trace:
    """Return a step of 0.2 at 1 s, and an answer to it as a share of the step, against the time since."""
    return Trace("elbow", TIME, np.where(TIME >= 1.0, 0.2, 0.0), TIME, 0.2 * answer)


def first_order(constant: float) -> Array:
    return np.asarray(np.where(TIME >= 1.0, 1.0 - np.exp(-(TIME - 1.0) / constant), 0.0))


@pytest.mark.slow
@settings(max_examples=40)
@given(lag=st.floats(0.0, 0.4), gain=st.floats(0.2, 2.0))
def test_delay_is_found_for_any_lag_and_gain(lag: float, gain: float) -> None:
    found = delay(sine(lag=lag, gain=gain), 0.5)
    assert found is not None
    assert found == pytest.approx(lag, abs=0.006)  # a target holds for 10 ms, and is 5 ms old on average


def test_tracking_of_delayed_sine_has_its_errors() -> None:
    found = tracking(sine(lag=0.04), period=2.0)
    amplitude = 2 * 0.3 * math.sin(math.pi * 0.5 * 0.04)
    assert found.worst == pytest.approx(amplitude, rel=0.01)
    assert found.rms == pytest.approx(amplitude / math.sqrt(2), rel=0.05)
    assert found.judged == found.worst
    assert found.rate == pytest.approx(100.0)
    assert found.step is None


@pytest.mark.parametrize("gain", [0.0, 0.01])
def test_delay_of_still_joint_is_none(gain: float) -> None:
    assert delay(sine(gain=gain), 0.5) is None


def test_delay_beyond_search_range_is_none() -> None:
    assert delay(sine(lag=0.5), 0.3) is None


def test_delay_of_opposite_motion_is_none() -> None:
    assert delay(sine(gain=-1.0), 0.2) is None


def test_first_order_step_has_known_figures() -> None:
    found = tracking(step(first_order(0.05)), period=10.0, edges=[1.0]).step
    assert found is not None
    assert found.rise == pytest.approx(0.05 * math.log(9), abs=0.003)
    assert found.settling == pytest.approx(0.05 * math.log(20), abs=0.011)
    assert found.overshoot == 0.0
    assert found.rest == pytest.approx(0.0, abs=1e-9)


def test_overshoot_is_share_of_step() -> None:
    swing = np.where(TIME >= 1.0, 1.0 - np.exp(-3 * (TIME - 1.0)) * np.cos(10 * (TIME - 1.0)), 0.0)
    found = tracking(step(swing), period=10.0, edges=[1.0]).step
    assert found is not None
    assert found.overshoot == pytest.approx(swing.max() - 1.0, abs=1e-6)
    assert found.overshoot > 0.3
    assert found.settling is not None
    assert found.settling > 0.5


def test_step_that_stops_half_way_does_not_settle() -> None:
    found = tracking(step(0.5 * first_order(0.05)), period=10.0, edges=[1.0])
    assert found.step is not None
    assert (found.step.rise, found.step.settling) == (None, None)
    assert found.step.rest == found.judged == pytest.approx(0.1)


def test_worst_of_several_steps_is_reported() -> None:
    target = np.where((TIME >= 1.0) & (TIME < 2.0), 0.2, 0.0)
    quick = np.where(TIME >= 1.0, 0.2 * (1.0 - np.exp(-(TIME - 1.0) / 0.02)), 0.0)
    slow = np.where(TIME >= 2.0, 0.2 * np.exp(-(TIME - 2.0) / 0.1), quick)
    found = tracking(Trace("elbow", TIME, target, TIME, slow), period=2.0, edges=[1.0, 2.0]).step
    assert found is not None
    assert found.rise == pytest.approx(0.1 * math.log(9), abs=0.01)


def test_step_without_samples_is_left_out() -> None:
    trace = step(first_order(0.05))
    assert tracking(trace, period=2.0, edges=[9.0]).step is None
    assert tracking(trace, period=2.0, edges=[0.5]).step is not None
