"""Service for the solid shapes of a cell."""

import json

from cellwright.cell.cell import Cell
from cellwright.cell.model.solids import solids
from cellwright.clients.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.config.trial.trial import Trial
from tests.support.cells import BARE, call


def test_client_gets_solids_as_the_model_has_them() -> None:
    cell = Cell(Trial("", has_arm=True))
    before = cell.state_hash()
    assert Client(InProcess(cell, node="/agent")).solids() == solids(cell.world)
    assert cell.state_hash() == before


def test_service_answers_the_same_each_time_also_without_arm() -> None:
    cell = Cell(BARE)
    first, second = (call(cell, "/cellwright/solids") for _ in range(2))
    assert first.success
    assert first.message == second.message
    assert list(json.loads(first.message)) == ["world"]
