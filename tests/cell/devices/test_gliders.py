"""Gliders: when a part has its belt's velocity, and how far it is to the belt's end."""

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.devices.gliders import BeltEnd, Ends, Gliders

BELTS = {3: (0.2, 0.0, 0.0), 1: (0.0, 0.5, 0.0)}
"""Velocity [m/s] of the belt of each of two bodies."""
DOFS = np.arange(30).reshape(5, 6)


def riding() -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Return velocities of five free bodies, of which two ride."""
    qvel = np.zeros(30)
    qvel[18:21], qvel[6:9] = BELTS[3], BELTS[1]
    return qvel


def test_no_glider_is_pushed_that_has_its_belts_velocity() -> None:
    gliders = Gliders.of([0.2, 0.5], BELTS, DOFS)
    qvel = riding()
    assert gliders.find_pushed(qvel) == []
    qvel[:6] = 1.0  # another body's
    assert gliders.find_pushed(qvel) == []


@pytest.mark.parametrize(("change", "pushed"), [(-0.0, []), (4e-5, []), (6e-5, [3]), (math.nan, [3])])
def test_glider_is_pushed_whose_velocity_is_off(change: float, pushed: list[int]) -> None:
    qvel = riding()
    qvel[19] = change
    assert Gliders.of([0.2, 0.5], BELTS, DOFS).find_pushed(qvel) == pushed


def test_without_gliders_nothing_is_pushed() -> None:
    assert Gliders.of([0.2], {}, DOFS).find_pushed(np.ones(30)) == []


@given(yaw=st.floats(-3.0, 3.0), along=st.floats(-9.0, 9.0), across=st.floats(-2.0, 2.0), half=st.floats(0.01, 0.3))
def test_gap_to_end_is_that_of_foremost_corner_along_belt(yaw: float, along: float, across: float, half: float) -> None:
    direction = (math.cos(yaw), math.sin(yaw), 0.0)
    middle = np.array((along * direction[0] - across * direction[1], along * direction[1] + across * direction[0], 1.0))
    sides = np.concatenate([middle - half, -middle - half])[:, None]
    corners = [middle[:2] + half * np.array(signs) for signs in product((-1.0, 1.0), repeat=2)]
    gap = 5.0 - max(float(corner @ direction[:2]) for corner in corners)
    end, found = BeltEnd.at(5.0, direction), np.empty(1)
    Ends.of([end]).gaps(sides, found)
    assert found[0] == pytest.approx(gap, abs=1e-9)
    assert end.gap(sides[:, 0]) == pytest.approx(gap, abs=1e-9)


def test_part_on_no_belt_has_no_end() -> None:
    ends, found = Ends.of([None, BeltEnd.at(2.0, (1.0, 0.0, 0.0))]), np.empty(2)
    assert ends.exist
    ends.gaps(np.array([(0.0, 0.0, 0.0, -1.0, -1.0, -1.0)] * 2).T, found)
    assert found.tolist() == [np.inf, 1.0]
    assert not Ends.of([None]).exist
