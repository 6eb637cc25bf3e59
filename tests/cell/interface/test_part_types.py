"""Service for the part types of a trial's own."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.config.trial.gear2017 import load_trial
from tests.support.cells import BARE, call
from tests.support.own_parts import write_trial


def client(cell: Cell) -> Client:
    return Client(InProcess(cell, node="/agent"))


def test_trial_without_user_defined_parts_reports_no_part_types() -> None:
    assert client(Cell(BARE)).part_types() == {}


def test_part_types_report_mass_box_and_spots_without_effect(tmp_path: Path) -> None:
    cell = Cell(load_trial([write_trial(tmp_path, "my_can", "my_ball")]).trial)
    before = cell.state_hash()
    reply = client(cell).part_types()["my_can"]
    assert reply["mass"] == 0.5
    assert len(reply["tops"]) == 6
    can = SimpleNamespace(**reply["tops"][0])
    assert can.turn == [1.0, 0.0, 0.0, 0.0]
    assert can.lower == pytest.approx([-0.035, -0.035, -0.06])
    assert can.upper == pytest.approx([0.035, 0.035, 0.06])
    assert can.radius == pytest.approx(0.035, abs=0.001)
    assert can.centre_of_mass == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)
    assert can.spots[0]["position"] == pytest.approx([0.0, 0.0, 0.06], abs=0.001)
    assert can.spots[0]["radius"] == pytest.approx(0.035, abs=0.001)
    assert call(cell, "/cellwright/part_types").success
    assert cell.state_hash() == before
