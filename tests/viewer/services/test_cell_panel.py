"""Panel of a cell: complete, without the secrets of a competition."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import pytest

from cellwright.cell.cell import Cell
from cellwright.middleware.messages.osrf_gear import AGVControlRequest
from cellwright.middleware.messages.standard import String
from cellwright.viewer.services.cell_panel import CellPanel
from tests.cell.arm_cells import finger_cell
from tests.support.cells import KITTING, WHOLE, call, order, publish, run, start

FAULTY = replace(KITTING, faulty_parts=frozenset({"gear_part_2"}))


def panel(cell: Cell) -> dict[str, Any]:
    """Panel as it arrives at a client."""
    values: dict[str, Any] = json.loads(json.dumps(CellPanel(cell, {"agent": "me"}).panel(), allow_nan=False))
    return values


def deliver(cell: Cell) -> None:
    """Submit the kit on tray 1."""
    assert call(cell, "agv1", AGVControlRequest(kit_type="order_0_kit_0")).success
    run(cell, 1.0)


def test_panel_before_start_has_no_orders() -> None:
    values = panel(Cell(KITTING))
    assert (values["kind"], values["name"], values["state"], values["orders"]) == ("cell", "kitting", "init", [])
    assert values["about"]["agent"] == "me"
    assert values["score"]["total"] == 0.0
    assert values["result"] is None
    assert values["grippers"] == []


def test_panel_previews_points_of_tray_before_submission() -> None:
    cell = Cell(KITTING)
    start(cell)
    run(cell, 1.1)
    values = panel(cell)
    (found,) = values["orders"]
    assert (found["status"], found["kits"][0]["submitted"]) == ("active", False)
    first, second = values["trays"]
    assert [part["type"] for part in first["parts"]] == ["gear_part", "gear_part"]
    (preview,) = first["as_kits"]
    assert (preview["kit_type"], preview["total"], preview["best"]) == ("order_0_kit_0", 6.0, 6.0)
    assert second["as_kits"][0]["total"] == 0.0
    assert values["score"]["total"] == 0.0, "a preview is not a submission"


def test_panel_requests_leave_state_hash_unchanged() -> None:
    cell, other = Cell(KITTING), Cell(KITTING)
    for each in (cell, other):
        start(each)
    for _ in range(11):
        run(cell, 0.1)
        run(other, 0.1)
        panel(cell)
    assert cell.state_hash() == other.state_hash()


@pytest.mark.parametrize("competition", [True, False])
def test_panel_with_cached_values_equals_new_panel(*, competition: bool) -> None:
    """Values cached between two requests are not stale."""
    cell = Cell(FAULTY, competition=competition)
    watching = CellPanel(cell, {"agent": "me"})
    seen = []

    def look() -> None:
        seen.append(json.loads(json.dumps(watching.panel())))
        assert seen[-1] == panel(cell)

    look()
    start(cell)
    for _ in range(6):
        run(cell, 0.3)
        look()
    deliver(cell)
    look()
    previews = [values["trays"][0]["as_kits"] for values in seen]
    assert [] in previews
    assert any(previews)


def test_judged_kit_has_points_with_reasons() -> None:
    cell = Cell(KITTING)
    start(cell)
    run(cell, 1.1)
    deliver(cell)
    values = panel(cell)
    assert values["score"]["total"] == 6.0
    (kit,) = values["score"]["orders"][0]["kits"]
    assert [part["cause"] for part in kit["parts"]] == ["placed", "placed"]
    assert all("in its place" in part["sentence"] for part in kit["parts"])
    assert values["orders"][0]["status"] == "complete"
    assert (values["state"], values["end_reason"]) == ("done", "all orders complete")
    assert values["trays"][0]["as_kits"] == []


def test_panel_values_that_always_change_are_under_clock_only() -> None:
    cell = Cell(KITTING)
    start(cell)
    run(cell, 1.5)
    before = panel(cell)
    run(cell, 0.25)
    after = panel(cell)
    assert before.pop("clock")["time"] < after.pop("clock")["time"]
    assert before == after


def test_panel_in_competition_hides_faulty_parts_until_judged() -> None:
    cell = Cell(FAULTY)
    start(cell)
    run(cell, 1.1)
    values = panel(cell)
    assert values["trays"][0]["as_kits"][0]["total"] == 6.0
    assert "faulty" not in json.dumps(values).replace('"faulty": false', "")
    assert values["score"]["reachable"] == 6.0, "fewer would tell that a good part is missing"
    deliver(cell)
    values = panel(cell)
    assert values["score"]["total"] == 2.0
    assert [part["cause"] for part in values["score"]["orders"][0]["kits"][0]["parts"]] == ["placed", "faulty"]


def test_panel_in_development_mode_names_faulty_parts() -> None:
    cell = Cell(FAULTY, competition=False)
    start(cell)
    run(cell, 1.1)
    values = panel(cell)
    assert [part["faulty"] for part in values["trays"][0]["parts"]] == [False, True]
    assert values["trays"][0]["as_kits"][0]["total"] == 2.0


@pytest.mark.parametrize("competition", [True, False])
def test_panel_shows_orders_to_come_in_development_mode_only(competition: bool) -> None:
    trial = replace(KITTING, orders=(order(), order(1, start_time=100.0)))
    cell = Cell(trial, competition=competition)
    start(cell)
    run(cell, 0.1)
    values = panel(cell)
    known = [(each["order_id"], each["status"]) for each in values["orders"]]
    assert known == [("order_0", "active"), ("order_1", "to come")][: 1 if competition else 2]
    assert ("order_1" in json.dumps(values)) is not competition


def test_interrupted_order_keeps_its_kit_preview() -> None:
    cell = Cell(replace(KITTING, orders=(order(), order(1, start_time=0.5))))
    start(cell)
    run(cell, 1.1)
    values = panel(cell)
    assert [each["status"] for each in values["orders"]] == ["interrupted", "active"]
    assert [each["kit_type"] for each in values["trays"][0]["as_kits"]] == ["order_0_kit_0", "order_1_kit_0"]


def test_ended_game_leaves_order_open() -> None:
    cell = Cell(KITTING)
    start(cell)
    run(cell, 0.1)
    call(cell, "end_competition")
    assert panel(cell)["orders"][0]["status"] == "open"


def test_panel_has_belt_agvs_and_gripper() -> None:
    cell = Cell(WHOLE)
    start(cell)
    values = panel(cell)
    service = "/ariac/conveyor/control"
    assert values["belts"] == [{"name": "belt", "service": service, "power": 100.0, "population": True}]
    assert values["fixed_trays"] == []
    assert [agv["state"] for agv in values["agvs"]] == ["ready_to_deliver", "ready_to_deliver"]
    gripper = {"name": "gripper", "enabled": False, "width": None, "attached": False, "part": None}
    assert values["grippers"] == [gripper]
    assert panel(Cell(finger_cell()))["grippers"] == [{**gripper, "width": 0.1}]
    assert values["refused"]["belt"].startswith("not available in competition mode")
    assert panel(Cell(WHOLE, competition=False))["refused"] == {}


def test_panel_has_intention_of_agent_with_its_time() -> None:
    cell = Cell(KITTING)
    assert panel(cell)["intention"] is None
    run(cell, 0.5)
    publish(cell, "/cellwright/intention", String("fetching a gear"), node="/robot")
    assert panel(cell)["intention"] == {"text": "fetching a gear", "node": "/robot", "time": 0.5}
