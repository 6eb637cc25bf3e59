"""Slots of the shelf."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.model.parts import PART_TYPES, part_type
from cellwright.cell.model.shelf import SHELF_PITCH, SHELF_SURFACE, shelf_slot
from tests.support.places import LAYOUT

SHELF = LAYOUT.shelf


@pytest.mark.slow
@given(st.integers(1, 400), st.data())
def test_shelf_slots_are_at_least_pitch_apart(count: int, data: st.DataObject) -> None:
    first = data.draw(st.integers(0, count - 1))
    second = data.draw(st.integers(0, count - 1).filter(lambda other: other != first) if count > 1 else st.just(first))
    here, there = shelf_slot(SHELF, first, count, 0.0), shelf_slot(SHELF, second, count, 0.0)
    assert here.position[2] == SHELF_SURFACE
    if first != second:
        assert math.dist(here.position, there.position) >= SHELF_PITCH - 1e-9


def test_shelf_pitch_exceeds_size_of_each_part() -> None:
    for kind in PART_TYPES:
        (x0, y0, _), (x1, y1, _) = part_type(kind).box
        assert 2 * math.hypot(max(-x0, x1), max(-y0, y1)) < SHELF_PITCH
