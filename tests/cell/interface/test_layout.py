"""Service for the layout of a cell."""

import json
from dataclasses import replace

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.client import Client
from cellwright.config.layout.layout import Layout
from cellwright.config.trial.trial import Options, Trial
from cellwright.util.pose import Pose
from tests.support.cells import BARE, call
from tests.support.places import LAYOUT


@pytest.mark.parametrize("layout", [LAYOUT, LAYOUT.moved(Pose.from_rpy((2.0, 1.0, 0.0), (0.0, 0.0, 0.5)))])
@pytest.mark.parametrize("competition", [False, True])
def test_client_gets_the_layout_of_the_cell(layout: Layout, competition: bool) -> None:
    cell = Cell(Trial("", layout=layout), competition=competition)
    before = cell.state_hash()
    assert Client.in_process(cell).layout() == layout
    assert cell.state_hash() == before


def test_answer_has_only_what_is_in_the_cell_and_the_same_each_time() -> None:
    cell = Cell(replace(BARE, options=Options(insert_agvs=False)))
    first, second = (call(cell, "/cellwright/layout") for _ in range(2))
    assert first.success
    assert first.message == second.message
    assert json.loads(first.message)["carriers"] == []
    assert Client.in_process(cell).layout().carriers == ()


def test_parts_and_orders_are_not_in_the_answer() -> None:
    assert "part" not in call(Cell(BARE), "/cellwright/layout").message
