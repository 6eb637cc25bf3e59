"""Tests of the timeline of a running cell."""

from __future__ import annotations

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.client.client import Client
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.running.evaluation.execution.worker import Timeline
from cellwright.running.run import RunOptions, run_cell
from tests.running.run.test_cells import Script, deliver_and_go_on, work
from tests.support.cells import KITTING


def test_timeline_has_orders_kits_and_agv_states() -> None:
    cell = Cell(KITTING)
    timeline = Timeline(cell)
    result = run_cell(cell, Script(deliver_and_go_on), RunOptions(on_progress=lambda _: timeline.look()))
    document = timeline.as_json()
    assert document["end"] == result.simulated
    (order,) = document["orders"]
    assert order["announced"] == pytest.approx(0.0, abs=0.01)
    assert order["completed"] == pytest.approx(1.85, abs=0.01)
    (kit,) = document["kits"]
    assert kit == {"time": pytest.approx(1.85, abs=0.01), "agv": "1", "kit": "order_0_kit_0", "points": 6.0}
    states = [span["state"] for span in document["agvs"]["1"]]
    assert states == ["ready_to_deliver", "preparing_to_deliver", "delivering"]
    assert [span["state"] for span in document["agvs"]["2"]] == ["ready_to_deliver"]
    assert document["agvs"]["1"][0]["end"] == document["agvs"]["1"][1]["begin"] == pytest.approx(1.2)
    assert document["agvs"]["1"][-1]["end"] is None
    assert document["held"] == []


@pytest.mark.slow
def test_timeline_does_not_change_run() -> None:
    cell = Cell(KITTING)
    timeline = Timeline(cell)
    watched = run_cell(cell, Script(deliver_and_go_on), RunOptions(on_progress=lambda _: timeline.look()))
    assert watched.state_hash == work(deliver_and_go_on).state_hash


@pytest.mark.slow
def test_timeline_has_part_in_gripper() -> None:
    above, on = [2.5, 0.25, -1.0, 3.2, 3.0, -1.51, 0.0], [2.09, 0.25, -0.47, 3.2, 3.1, -1.51, 0.0]

    def pick(client: Client) -> None:
        client.control_gripper(True)
        client.send_arm([above, on])
        client.wait_until(lambda: client.gripper_attached, timeout=5.0)
        client.send_arm([above])
        client.sleep(1.0)
        client.control_gripper(False)
        client.sleep(0.5)

    cell = Cell(load_trial([find_trial("lesson")]).trial)
    timeline = Timeline(cell)
    run_cell(cell, Script(pick))
    (held,) = timeline.as_json()["held"]
    assert held["type"] == "piston_rod_part"
    assert held["part"].startswith("bin7|piston_rod_part_")
    assert 0.5 < held["end"] - held["begin"] < 2.0
