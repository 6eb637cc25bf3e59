"""Times and velocities along tool paths."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.agents.kitter.motion import ease_in_out, velocities_along


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_ease_in_out_inverts_cubic_and_rises(one: float, other: float) -> None:
    """It is the inverse of the cubic from rest to rest."""
    share = ease_in_out(one)
    assert 3 * share**2 - 2 * share**3 == pytest.approx(one, abs=1e-7)
    assert (ease_in_out(one) <= ease_in_out(other) + 1e-12) or one > other


def test_velocities_are_slopes_between_neighbours_and_end_at_rest() -> None:
    found = velocities_along([0.0, 0.0], [[1.0, 0.0], [2.0, -1.0], [2.0, -1.0]], [1.0, 2.0, 4.0])
    assert found == [[1.0, -0.5], [pytest.approx(1.0 / 3.0), pytest.approx(-1.0 / 3.0)], [0.0, 0.0]]
