"""Panels of a cell as read: ticks, points with their reasons, and no foreign markup."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.cell.cell import Cell
from cellwright.middleware.messages.osrf_gear import AGVControlRequest
from cellwright.middleware.messages.standard import String
from cellwright.viewer.services.cell_panel import CellPanel
from cellwright.viewer.web import cell_panels
from tests.cell.arm_cells import finger_cell
from tests.support.cells import KITTING, WHOLE, call, order, publish, run, start

PIECES = (
    cell_panels.head_html,
    cell_panels.game_html,
    cell_panels.orders_html,
    cell_panels.trays_html,
    cell_panels.evidence_html,
    cell_panels.floor_html,
)


class Words(HTMLParser):
    """Text of an HTML document, and its elements."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[str] = []
        self.open: list[str] = []
        self.elements: set[str] = set()
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.add(tag)
        assert all(name == "style" for name, _ in attrs)
        self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.found.append(data)

    def __str__(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.found))


def words(text: str) -> str:
    """Visible text; every element is closed."""
    found = Words(text)
    assert not found.open
    assert found.elements <= {"div", "span", "b", "pre"}
    return str(found)


def panel_of(cell: Cell) -> dict[str, Any]:
    """Panel as it arrives at a client."""
    panel: dict[str, Any] = json.loads(json.dumps(CellPanel(cell, {"agent": "me"}).panel()))
    return panel


def judged() -> Cell:
    """Cell with a submitted kit."""
    cell = Cell(KITTING)
    start(cell)
    run(cell, 1.1)
    assert call(cell, "agv1", AGVControlRequest(kit_type="order_0_kit_0")).success
    run(cell, 1.0)
    return cell


def test_html_before_start_has_no_orders() -> None:
    panel = panel_of(Cell(WHOLE))
    texts = {piece.__name__: words(piece(panel)) for piece in PIECES}
    assert "whole" in texts["head_html"]
    assert "agent me · seed 0 · servo original" in texts["head_html"]
    assert "has not started" in texts["game_html"]
    assert "no order" in texts["orders_html"]
    assert "empty" in texts["trays_html"]
    assert "suction off, holds nothing" in texts["floor_html"]


def test_fingers_show_how_far_they_are_open() -> None:
    assert "open 100 mm, holds nothing" in words(cell_panels.floor_html(panel_of(Cell(finger_cell()))))


def test_parts_on_tray_are_ticked_before_submission() -> None:
    cell = Cell(KITTING)
    start(cell)
    run(cell, 1.1)
    panel = panel_of(cell)
    assert words(cell_panels.orders_html(panel)).count("✓") == 2
    assert "2 of 2" in words(cell_panels.orders_html(panel))
    assert "as order_0_kit_0 now 6 of 6" in words(cell_panels.trays_html(panel))
    assert "not submitted: no points" in words(cell_panels.evidence_html(panel))
    assert call(cell, "agv1", AGVControlRequest(kit_type="order_0_kit_0")).success
    assert "on its way: no points" in words(cell_panels.evidence_html(panel_of(cell)))
    assert "0 of 6 points" in words(cell_panels.head_html(panel))


def test_judged_kit_has_reason_for_each_point() -> None:
    panel = panel_of(judged())
    texts = words(cell_panels.evidence_html(panel))
    assert "order_0_kit_0 6 of 6" in texts
    assert texts.count("in its place, off by") == 2
    assert "the tray held exactly what was ordered" in texts
    assert "sent: 6 of 6" in words(cell_panels.orders_html(panel))
    assert "complete" in words(cell_panels.orders_html(panel))


def test_faulty_parts_are_marked() -> None:
    cell = Cell(replace(KITTING, faulty_parts=frozenset({"gear_part_2"})), competition=False)
    start(cell)
    run(cell, 1.1)
    panel = panel_of(cell)
    assert "faulty" in words(cell_panels.trays_html(panel))
    assert "gear_part (faulty)" in words(cell_panels.orders_html(panel))


def test_order_to_come_has_start_time() -> None:
    cell = Cell(replace(KITTING, orders=(order(), order(1, start_time=100.0))), competition=False)
    start(cell)
    assert "at 100 s to come" in words(cell_panels.orders_html(panel_of(cell)))


@pytest.mark.parametrize(("limit", "expected"), [(None, "game 1 s,"), (10.0, "game 1 of 10 s,")])
def test_game_html_has_elapsed_time_and_limit(limit: float | None, expected: str) -> None:
    cell = Cell(replace(KITTING, time_limit=limit))
    start(cell)
    run(cell, 1.1)
    assert expected in words(cell_panels.game_html(panel_of(cell)))


def test_result_html_has_outcome_score_and_error() -> None:
    panel = panel_of(judged())
    assert cell_panels.result_html(panel) == ""
    panel["result"] = {"outcome": "time_limit", "error": "", "simulated": 12.0, "wall": 3.0, "state_hash": 64 * "a"}
    assert "the run is over: time limit 12.0 s in 3.0 s 6 of 6 points all orders complete" in words(
        cell_panels.head_html(panel)
    )
    panel["result"] |= {"outcome": "crashed", "error": "Traceback <module>"}
    assert "Traceback <module>" in words(cell_panels.head_html(panel))


def test_html_after_run_shows_final_state() -> None:
    cell = Cell(KITTING)
    start(cell)
    publish(cell, "/cellwright/intention", String("fetching a gear"))
    run(cell, 1.1)
    assert call(cell, "agv1", AGVControlRequest(kit_type="order_0_kit_0")).success
    shows = CellPanel(cell, {"agent": "me"})

    def texts() -> dict[str, str]:
        panel = json.loads(json.dumps(shows.panel()))
        return {piece.__name__: words(piece(panel)) for piece in PIECES}

    before = texts()
    assert "go agent me" in before["head_html"]
    assert "➤ fetching a gear" in before["head_html"]
    assert "AGV 1 preparing to deliver ▪" in before["trays_html"]
    assert "active" in before["orders_html"]
    shows.end({"outcome": "until", "error": "", "simulated": 1.2, "wall": 3.0, "state_hash": 64 * "a"})
    after = texts()
    assert "go at the end agent me" in after["head_html"]
    assert "last: fetching a gear" in after["head_html"]
    assert "➤" not in after["head_html"]
    assert "the run is over: stopped before the competition was done 1.2 s in 3.0 s 0 of 6 points" in after["head_html"]
    assert "AGV 1 preparing to deliver at the end ▪" in after["trays_html"]
    assert "AGV 2 ready to deliver at the end empty" in after["trays_html"]
    assert "as order_0_kit_0 at the end 6 of 6" in after["trays_html"]
    assert after["floor_html"].strip().startswith("state at the end of the run")
    assert ("active" in after["orders_html"], "open" in after["orders_html"]) == (False, True)
    shows.restart()
    assert texts() == before


def test_collisions_are_listed_newest_first() -> None:
    panel = panel_of(Cell(KITTING))
    assert "Collisions 0" not in words(cell_panels.floor_html(panel)), "there is no collision watch"
    post = {"link": "forearm_link", "obstacle": "camera frame 2", "begin": 4.3, "end": None, "deviation": 0.431}
    bin7 = {"link": "wrist_3_link", "obstacle": "bin7", "begin": 2.0, "end": 2.5, "deviation": 0.004}
    panel["collisions"] = {"count": 0, "latest": []}
    assert "Collisions 0" in words(cell_panels.floor_html(panel))
    assert "✸" not in words(cell_panels.head_html(panel))
    panel["collisions"] = {"count": 5, "latest": [bin7, post]}
    assert words(cell_panels.floor_html(panel)).endswith(
        "Collisions 5 ✸ t 4.3 s forearm_link against camera frame 2; tool 431 mm from its goal "
        "✸ t 2.0 s wrist_3_link against bin7 for 0.5 s and 3 earlier"
    )
    assert "✸ t 4.3 s forearm_link against camera frame 2; tool 431 mm from its goal (5 collisions)" in words(
        cell_panels.head_html(panel)
    )


@given(st.text(min_size=1, max_size=60))
@settings(deadline=None)
def test_foreign_text_is_shown_escaped(text: str) -> None:
    panel = panel_of(_JUDGED)
    panel["name"] = panel["about"]["agent"] = text
    panel["intention"] = {"text": text, "node": "/me", "time": 0.0}
    hit = {"link": text, "obstacle": text, "begin": 0.0, "end": None, "deviation": 0.0}
    panel["collisions"] = {"count": 2, "latest": [hit, hit]}
    for tray in panel["trays"]:
        tray["parts"] = [{"name": text, "type": text, "faulty": True}]
    for each in panel["orders"]:
        each["order_id"] = each["status"] = text
        each["kits"] = [{"kit_type": text, "submitted": False, "parts": [text]}]
    for kit in panel["score"]["orders"][0]["kits"]:
        kit |= {"kit_type": text, "bonus_reason": text}
        kit["parts"] = [part | {"type": text, "sentence": text} for part in kit["parts"]]
        kit["extras"] = [{"name": text, "type": text, "reason": text}]
    for piece in PIECES:
        words(piece(panel))


def test_markup_in_intention_is_escaped() -> None:
    cell = Cell(KITTING)
    publish(cell, "/cellwright/intention", String("<script>alert(1)</script> {1+1}"))
    assert "<script>alert(1)</script> {1+1}" in words(cell_panels.head_html(panel_of(cell)))


_JUDGED = judged()
