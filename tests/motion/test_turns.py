import math

from hypothesis import given
from hypothesis import strategies as st

from cellwright.motion.turns import nearest_turn, principal, turn_range, turned

ANGLES = st.floats(-20.0, 20.0)


@given(ANGLES, ANGLES, st.floats(-8.0, 2.0), st.floats(0.0, 12.0))
def test_nearest_turn_is_best_of_all_within_limits(angle: float, near: float, lower: float, width: float) -> None:
    upper = lower + width
    low, high = turn_range(angle, lower, upper)
    choices = [turned(angle, turns, lower, upper) for turns in range(low, high + 1)]
    found = nearest_turn(angle, near, lower, upper)
    if found is None:
        assert not choices
    else:
        assert lower <= found <= upper
        assert abs(principal(found - angle)) < 1e-8
        assert abs(found - near) <= min(abs(each - near) for each in choices) + 1e-9


@given(ANGLES, ANGLES)
def test_nearest_turn_without_limits_is_within_half_a_turn(angle: float, near: float) -> None:
    found = nearest_turn(angle, near, -math.inf, math.inf)
    assert found is not None
    assert abs(found - near) <= math.pi + 1e-9


def test_nearest_turn_keeps_one_sided_limit() -> None:
    assert nearest_turn(0.5, 9.0, -math.inf, 1.0) == 0.5
    assert nearest_turn(1.5, 1.0, -math.inf, 1.0) == 1.5 - 2 * math.pi


def test_angle_beyond_limit_by_rounding_is_put_there() -> None:
    assert nearest_turn(1.0 + 1e-12, 1.0, 0.0, 1.0) == 1.0
