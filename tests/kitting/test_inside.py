"""The cell in the process of an agent."""

from typing import cast

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.client import Client
from cellwright.config.trial.trial import Trial
from cellwright.util.errors import UsageError
from kitting.inside import cell_of


def test_client_in_the_process_has_its_cell() -> None:
    cell = Cell(Trial("empty"))
    assert cell_of(Client.in_process(cell)) is cell


def test_other_transport_is_refused() -> None:
    class Far:
        transport = object()

    with pytest.raises(UsageError, match="it uses what no sensor tells, so it needs the cell in its process"):
        cell_of(cast("Client", Far()))
