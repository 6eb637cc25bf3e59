"""Presence of AGVs, from their states."""

from cellwright.cell.cell import Cell
from cellwright.clients.agents.kitter.cell_view import CellView
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from tests.support.cells import KITTING


def test_agv_is_ready_until_sent() -> None:
    cell = Cell(KITTING)
    client = Client(InProcess(cell, node="/agent"))
    view = CellView(client, Catalogue(), ())
    assert not view.is_agv_ready(1), "no message yet"
    client.sleep(0.01)
    assert view.is_agv_ready(1)
    assert view.is_agv_ready(2)
    client.control_agv(1, "kit")
    client.sleep(0.01)
    assert not view.is_agv_ready(1)
    assert view.is_agv_ready(2)


def test_agv_states_are_subscribed_only_while_watched() -> None:
    cell = Cell(KITTING)
    client = Client(InProcess(cell, node="/agent"))
    view = CellView(client, Catalogue(), ())
    view.watch_agvs(True)
    assert cell.bus.topic("/ariac/agv2/state").subscribers == ("/agent",)
    view.watch_agvs(False)
    view.watch_agvs(False)
    assert cell.bus.topic("/ariac/agv2/state").subscribers == ()
    client.control_agv(2, "kit")
    view.watch_agvs(True)
    client.sleep(0.01)
    assert not view.is_agv_ready(2)
