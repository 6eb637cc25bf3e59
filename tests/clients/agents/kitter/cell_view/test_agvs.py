"""Presence of AGVs, from their states."""

from cellwright.cell.cell import Cell
from cellwright.clients.agents.kitter.cell_view import CellView
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from tests.clients.agents.kitter.places import WORKPLACE
from tests.support.cells import KITTING


def test_agv_is_ready_until_sent() -> None:
    cell = Cell(KITTING)
    client = Client(InProcess(cell, node="/agent"))
    view = CellView(client, Catalogue(), WORKPLACE, {})
    assert not view.is_ready(1), "no message yet"
    client.sleep(0.01)
    assert view.is_ready(1)
    assert view.is_ready(2)
    client.control_agv(1, "kit")
    client.sleep(0.01)
    assert not view.is_ready(1)
    assert view.is_ready(2)


def test_agv_states_are_subscribed_only_while_watched() -> None:
    cell = Cell(KITTING)
    client = Client(InProcess(cell, node="/agent"))
    view = CellView(client, Catalogue(), WORKPLACE, {})
    view.watch_stations(True)
    assert cell.bus.topic("/ariac/agv2/state").subscribers == ("/agent",)
    view.watch_stations(False)
    view.watch_stations(False)
    assert cell.bus.topic("/ariac/agv2/state").subscribers == ()
    client.control_agv(2, "kit")
    view.watch_stations(True)
    client.sleep(0.01)
    assert not view.is_ready(2)
