"""Durations of motions."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.agents.kitter.motion import (
    MAX_JOINT_ACCELERATIONS,
    MAX_JOINT_SPEEDS,
    ease_in_out,
    travel_time,
    velocities_along,
)

joints = st.lists(st.floats(-3.0, 3.0), min_size=7, max_size=7)


@given(joints, joints)
def test_travel_time_keeps_speed_and_acceleration_limits(start: list[float], goal: list[float]) -> None:
    duration = travel_time(start, goal)
    for a, b, speed, acceleration in zip(start, goal, MAX_JOINT_SPEEDS, MAX_JOINT_ACCELERATIONS, strict=True):
        assert 1.5 * abs(b - a) / duration <= speed + 1e-9
        assert 6.0 * abs(b - a) / duration**2 <= acceleration + 1e-9


def test_travel_time_is_minimal() -> None:
    far, near = [1.0] + [0.0] * 6, [0.1] + [0.0] * 6
    assert travel_time([0.0] * 7, near) == pytest.approx((6.0 * 0.1 / 2.5) ** 0.5)
    assert travel_time([0.0] * 7, far) == pytest.approx((6.0 * 1.0 / 2.5) ** 0.5)
    assert travel_time(far, far) == 0.1


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_ease_in_out_inverts_cubic_and_rises(one: float, other: float) -> None:
    """It is the inverse of the cubic from rest to rest."""
    share = ease_in_out(one)
    assert 3 * share**2 - 2 * share**3 == pytest.approx(one, abs=1e-7)
    assert (ease_in_out(one) <= ease_in_out(other) + 1e-12) or one > other


def test_velocities_are_slopes_between_neighbours_and_end_at_rest() -> None:
    found = velocities_along([0.0, 0.0], [[1.0, 0.0], [2.0, -1.0], [2.0, -1.0]], [1.0, 2.0, 4.0])
    assert found == [[1.0, -0.5], [pytest.approx(1.0 / 3.0), pytest.approx(-1.0 / 3.0)], [0.0, 0.0]]
