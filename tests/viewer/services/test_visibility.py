"""Visibility of a cell's ground truth: all of it, but in a running competition nothing of the future."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.evidence import evidence_to_json
from cellwright.viewer.services.cell_panel import hides_ground_truth, known_evidence, known_orders, without_faults
from tests.support.cells import KITTING, call, order, run, start

SECRETIVE = replace(
    KITTING, orders=(order(), order(1, start_time=100.0)), faulty_parts=frozenset({"gear_part_1", "gear_part_2"})
)
"""Trial with two faulty ordered parts, and another order that comes late."""


def evidence_of(cell: Cell) -> dict[str, Any]:
    """Evidence as clients receive it."""
    found: dict[str, Any] = json.loads(json.dumps(evidence_to_json(known_evidence(cell))))
    return found


def started_cell(*, competition: bool = True) -> Cell:
    """Cell a moment after the first order was announced."""
    cell = Cell(SECRETIVE, competition=competition)
    start(cell)
    run(cell, 0.1)
    return cell


def test_competition_before_start_has_no_orders() -> None:
    cell = Cell(SECRETIVE)
    assert hides_ground_truth(cell)
    assert (evidence_of(cell)["orders"], evidence_of(cell)["best"]) == ([], 0.0)


def test_running_competition_shows_announced_orders_and_no_faults() -> None:
    cell = started_cell()
    assert [each.order_id for each in known_orders(cell)] == ["order_0"]
    assert without_faults(cell).faulty_parts == frozenset()
    assert "order_1" not in json.dumps(evidence_of(cell))
    assert (evidence_of(cell)["reachable"], evidence_of(cell)["best"]) == (6.0, 6.0), (
        "fewer would tell that parts are faulty"
    )


@pytest.mark.parametrize("is_over", [True, False])
def test_ended_competition_and_development_mode_hide_nothing(is_over: bool) -> None:
    cell = started_cell(competition=is_over)
    if is_over:
        assert call(cell, "end_competition").success
        cell.step()
    assert not hides_ground_truth(cell)
    assert [each["order_id"] for each in evidence_of(cell)["orders"]] == ["order_0", "order_1"]
    assert (evidence_of(cell)["reachable"], evidence_of(cell)["best"]) == (0.0, 12.0)
    assert known_evidence(cell) == cell.competition.evidence()
