"""Cell panels: their controls use the same services as every client."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cellwright.cell.cell import Cell
from cellwright.viewer.services.cell_panel import CellPanel
from cellwright.viewer.web.cell_panels import CELL, ORDERS, SCORE, CellPanels, cell_of
from tests.support.cells import KITTING, run, start
from tests.viewer.web.pages import clicked, page

JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)


def cell_panel(*, competition: bool = False) -> dict[str, Any]:
    cell = Cell(KITTING, competition=competition)
    start(cell)
    run(cell, 1.1)
    panel: dict[str, Any] = json.loads(json.dumps(CellPanel(cell).panel()))
    return panel


BELT = "/ariac/conveyor/control"


@pytest.fixture(scope="module")
def opened() -> Iterator[tuple[Any, CellPanels]]:
    with page(cell_panel()) as found:
        panels = CellPanels()
        panels.page = found
        panels.on_scene(None)  # type: ignore[arg-type]
        panels.panel(cell_panel())
        yield found, panels


def test_cell_panels_create_tabs_once(opened: tuple[Any, CellPanels]) -> None:
    found, panels = opened
    panels.on_scene(None)  # type: ignore[arg-type]
    assert found.tabs == [ORDERS, SCORE, CELL]


def test_cell_controls_call_services_of_belt_agv_and_tray(opened: tuple[Any, CellPanels]) -> None:
    found, panels = opened
    found.link.called.clear()
    clicked(panels._belts[BELT], 30.0)
    clicked(panels._send, "AGV 2")
    clicked(panels._clear, "tray 1")
    clicked(panels._game, "End")
    services = [service for service, _ in found.link.called]
    assert services == [
        "/ariac/conveyor/control",
        "/ariac/agv2",
        "/ariac/kit_tray_1/clear_tray",
        "/ariac/end_competition",
    ]
    assert found.link.called[0][1].state.power == 30.0
    assert found.link.called[1][1].kit_type == "order_0_kit_0"


def test_belt_slider_that_follows_belt_sends_nothing(opened: tuple[Any, CellPanels]) -> None:
    found, panels = opened
    found.link.called.clear()
    panels._slid_at = -100.0
    panels.panel(cell_panel() | {"belts": [{"name": "belt", "service": BELT, "power": 70.0, "population": None}]})
    assert panels._belts[BELT].value == 70.0
    assert found.link.called == []


def test_failed_call_is_notified(opened: tuple[Any, CellPanels]) -> None:
    found, panels = opened
    found.notices.clear()
    found.link.succeeds = False
    clicked(panels._send, "AGV 1")
    found.link.refuses = "the server is away"
    clicked(panels._send, "AGV 1")
    found.link.refuses, found.link.succeeds = "", True
    assert [text for _, text in found.notices] == ["no reason given", "the server is away"]


def test_cell_controls_in_competition_are_hidden_with_reason() -> None:
    with page(cell_panel(competition=True)) as found:
        panels = CellPanels()
        panels.page = found
        panels.on_scene(None)  # type: ignore[arg-type]
        panels.panel(cell_panel(competition=True))
        assert [handle.visible for handle in panels._doing] == 5 * [False]
        assert "development mode" in panels._why_not.content
        recorded = {"kind": "recording", "of": cell_panel()}
        panels.panel(recorded)
        assert "recordings are read-only" in panels._why_not.content


def test_cell_controls_after_run_or_disconnect_are_hidden_with_reason() -> None:
    with page(cell_panel()) as found:
        panels = CellPanels()
        panels.on_disconnect("never connected")
        panels.page = found
        panels.on_scene(None)  # type: ignore[arg-type]
        panels.panel(cell_panel() | {"refused": {"belt": "the run is over"}})
        assert [handle.visible for handle in panels._doing] == 5 * [False]
        assert "the run is over" in panels._why_not.content
        panels.panel(cell_panel())
        assert [handle.visible for handle in panels._doing] == 5 * [True]
        panels.on_disconnect("the cell has stopped")
        assert [handle.visible for handle in panels._doing] == 5 * [False]
        assert "the cell has stopped" in panels._why_not.content


@given(st.dictionaries(st.sampled_from(sorted(cell_panel())), JSON))
@settings(
    deadline=None, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
def test_panel_of_another_version_does_not_end_page(opened: tuple[Any, CellPanels], strange: dict[str, Any]) -> None:
    _, panels = opened
    panels.panel({"kind": "recording", "of": shared_panel() | strange})


def test_cell_of_other_panel_is_none() -> None:
    assert cell_of({"kind": "robot"}) is None
    assert cell_of({"kind": "recording", "of": {}}) is None
    assert cell_of({"kind": "recording", "of": ["cell"]}) is None
    assert cell_of({"kind": "recording"}) is None


_SHARED: dict[str, Any] = {}


def shared_panel() -> dict[str, Any]:
    if not _SHARED:
        _SHARED.update(cell_panel())
    return _SHARED
