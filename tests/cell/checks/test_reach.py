"""Reach over surfaces, compared with the kinematics point by point."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from cellwright.cell.checks.reach import CLEARANCE, in_reach, share_out_of_reach
from cellwright.cell.checks.surfaces import points_on, surfaces_in
from cellwright.config.arm import RAIL_LIMIT
from cellwright.config.layout.surfaces import Surface
from cellwright.config.trial.trial import Trial
from cellwright.motion.kinematics import inverse, tool_down
from cellwright.util.errors import UnreachableError
from cellwright.util.pose import Pose
from tests.cell.checks.odd import SMALL, bin_at, trial_with
from tests.support.places import LAYOUT

FOUND = surfaces_in(Trial("", layout=LAYOUT))


def is_reached(point: NDArray[np.float64], yaw: float) -> bool:
    x, y, z = map(float, point)
    for rail in np.linspace(-RAIL_LIMIT, RAIL_LIMIT, 85):
        try:
            inverse(tool_down(x, y, z + CLEARANCE, yaw), float(rail))
        except UnreachableError:
            continue
        return True
    return False


@given(
    surface=st.sampled_from(FOUND), where=st.tuples(st.floats(0, 0.999), st.floats(0, 0.999)), yaw=st.floats(-3.0, 3.0)
)
def test_reach_is_that_of_the_kinematics(surface: Surface, where: tuple[float, float], yaw: float) -> None:
    mask = in_reach(surface, LAYOUT)
    row, column = (int(share * count) for share, count in zip(where, mask.shape, strict=True))
    assert bool(mask[row, column]) == is_reached(points_on(surface)[row, column], yaw)


def test_reach_moves_with_the_cell() -> None:
    moved = LAYOUT.moved(Pose.from_rpy((2.0, 1.0, 0.0), (0.0, 0.0, pi / 2)))
    for one, other in zip(FOUND, surfaces_in(Trial("", layout=moved)), strict=True):
        assert share_out_of_reach(one, LAYOUT) == pytest.approx(share_out_of_reach(other, moved), abs=0.02)


def test_share_of_a_belt_is_of_its_width() -> None:
    belt = next(each for each in FOUND if each.is_belt)
    assert share_out_of_reach(belt, LAYOUT) == 0.0
    assert 0.3 < in_reach(belt, LAYOUT).mean() < 0.5


def test_far_bin_is_out_of_reach() -> None:
    layout = replace(SMALL, bins=(bin_at("far", -3.0, 0.0),))
    assert share_out_of_reach(surfaces_in(trial_with(layout))[0], layout) == 1.0
