"""Limits, where they are known."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.operators.robot import JointLimits
from cellwright.util.errors import UsageError
from tests.clients.operators.nodes import robot

LIMITS = JointLimits.of(robot().robot)


@pytest.mark.slow
@given(st.floats(-10.0, 10.0))
def test_clamped_position_is_nearest_within_limits(position: float) -> None:
    found = LIMITS.clamped("right_1", position)
    assert -2.0 <= found <= 2.0
    assert found == position or abs(found) == 2.0


def test_motion_beyond_limits_is_refused_with_figures() -> None:
    LIMITS.check("right_1", -2.0, 2.0, "a sine")
    with pytest.raises(UsageError, match=r"right_1: a sine from 0 to 2\.1 leaves its limits \(two arms\): -2 to 2"):
        LIMITS.check("right_1", 0.0, 2.1, "a sine")
    with pytest.raises(UsageError, match=r"from -3 to 0 leaves.*: -2 to 2; give less$"):
        LIMITS.check("right_1", -3.0, 0.0, "a sine", "give less")


def test_unknown_limits_accept_any_position() -> None:
    unknown = JointLimits()
    assert not unknown.is_known
    assert LIMITS.is_known
    assert unknown.clamped("right_1", 99.0) == 99.0
    unknown.check("right_1", -99.0, 99.0, "a sine")
