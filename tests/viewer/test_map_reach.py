"""Fields of maps by what arms reach."""

from dataclasses import replace

import numpy as np
import pytest

from cellwright.cell.checks.clearance import PlaceReach, State
from cellwright.cell.checks.surfaces import points_on, surfaces_in
from cellwright.viewer.map_reach import MARKS, OUT_OF_REACH, fields
from tests.cell.checks.odd import SMALL, bin_at, trial_with


def test_fields_out_of_reach_are_marked_on_a_map_of_the_cell() -> None:
    trial = trial_with(replace(SMALL, bins=(bin_at("near", -0.4, 0.5), bin_at("far", -3.0, 0.0)), trays=()))
    found = [*fields(trial, ())]
    assert {mark for mark, _, _ in found} == {OUT_OF_REACH}
    assert sum(x * y for _, _, (x, y) in found) == pytest.approx(0.36)
    assert all(middle.position[0] < -2.5 for _, middle, _ in found)


def test_each_point_has_the_best_state_of_all_arms() -> None:
    trial = trial_with(replace(SMALL, trays=()))
    left, right = surfaces_in(trial)
    shape = points_on(left).shape[:2]
    one, other = np.full(shape, State.OUT, np.int8), np.full(shape, State.OUT, np.int8)
    one[0], other[0, 0] = State.BLOCKED, State.CLEAR
    places = [
        PlaceReach(arm, surface, states, None)
        for arm, states in (("one", one), ("other", other))
        for surface in (left, right)
    ]
    areas = dict.fromkeys(State, 0.0)
    for mark, _, (x, y) in fields(trial, places):
        areas[mark.state] += x * y
    field = left.size[0] * left.size[1] / (shape[0] * shape[1])
    assert areas == pytest.approx(
        {State.CLEAR: 2 * field, State.BLOCKED: 2 * (shape[1] - 1) * field, State.OUT: 2 * 11 * 12 * field}
    )
    assert [mark.state for mark in MARKS] == [State.CLEAR, State.BLOCKED, State.OUT]


def test_cell_without_an_arm_has_no_fields() -> None:
    assert not [*fields(trial_with(SMALL, has_arm=False), ())]
