"""Whether AGVs are there, as they tell."""

from cellwright.cell.cell import Cell
from cellwright.clients.agents.kitter.cell_view import AgvStates
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from tests.cells import KITTING


def test_an_agv_is_ready_until_it_is_sent_off() -> None:
    cell = Cell(KITTING)
    client = Client(InProcess(cell, node="/agent"))
    agvs = AgvStates(client)
    client.sleep(0.1)
    assert not agvs.is_ready(1), "nobody has listened"
    agvs.listen()
    agvs.listen()
    assert not agvs.is_ready(1), "nothing was heard yet"
    client.sleep(0.01)
    assert agvs.is_ready(1)
    assert agvs.is_ready(2)
    client.control_agv(1, "kit")
    client.sleep(0.01)
    assert not agvs.is_ready(1)
    assert agvs.is_ready(2)
    assert not agvs.is_ready(3)
    agvs.rest()
    assert not agvs.is_ready(2)
    assert cell.bus.topic("/ariac/agv2/state").subscribers == ()
