"""Surfaces of a cell."""

import numpy as np
import pytest

from cellwright.cell.checks.surfaces import SPACING, points_on, surfaces_in
from cellwright.config.trial.trial import Options, Trial
from cellwright.util.pose import Pose
from tests.cell.checks.odd import SMALL, trial_with
from tests.support.places import BIN_CENTRES, BIN_SURFACE


def test_surfaces_have_the_keys_of_their_descriptions() -> None:
    found = surfaces_in(trial_with(SMALL))
    assert [each.key for each in found] == ["cell.bins.left", "cell.bins.right", "cell.trays.table"]


def test_agvs_that_are_not_in_the_cell_have_no_surface() -> None:
    found = surfaces_in(Trial("", options=Options(insert_agvs=False)))
    assert {each.section for each in found} == {"bins", "belts"}


def test_points_lie_in_a_grid_on_the_surface() -> None:
    bin1 = surfaces_in(Trial(""))[0]
    points = points_on(bin1)
    assert points.shape == (12, 12, 3)
    assert points.mean(axis=(0, 1)) == pytest.approx((*BIN_CENTRES["bin1"], BIN_SURFACE))
    assert np.linalg.norm(points[1, 0] - points[0, 0]) == pytest.approx(SPACING)


def test_points_turn_with_their_surface() -> None:
    _, right, _ = surfaces_in(trial_with(SMALL))
    local = Pose.inverse(right.middle)
    first = local.transform(tuple(points_on(right)[0, 0]))
    assert first == pytest.approx((-0.275, -0.275, 0.0))
