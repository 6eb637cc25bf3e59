"""Parts and belts of a cell, as an operator sees them."""

from __future__ import annotations

import pytest

from cellwright.cell.cell import Cell
from cellwright.running.run.surroundings import CellSurroundings
from tests.support.cells import WHOLE, run


def test_parts_are_those_in_play_where_they_are() -> None:
    cell = Cell(WHOLE)
    seen = CellSurroundings(cell)
    run(cell, 0.1)
    found = {part.name: part for part in seen.parts()}
    assert found.keys() == set(cell.parts.in_play)
    for name, part in found.items():
        there = cell.parts.part(name)
        assert part.type == there.type
        assert part.world_T_part.position == pytest.approx(cell.parts.pose(there).position)


def test_part_on_a_belt_moves_at_the_speed_of_the_belt() -> None:
    cell = Cell(WHOLE)
    seen = CellSurroundings(cell)
    cell.competition.start()
    run(cell, 3.0)
    (belt,) = seen.belts().values()
    assert belt[1] < -0.1
    on_belt = [part for part in seen.parts() if part.world_T_part.position[0] > 1.0]
    assert on_belt
    assert all(part.velocity == pytest.approx(belt, abs=5e-3) for part in on_belt)


def test_asking_changes_nothing() -> None:
    asked, other = Cell(WHOLE), Cell(WHOLE)
    for _ in range(5):
        CellSurroundings(asked).parts()
        run(asked, 0.1)
        run(other, 0.1)
    assert asked.state_hash() == other.state_hash()
