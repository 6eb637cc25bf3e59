"""Operator of a cell as a part of its page."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import pytest

from cellwright.clients.agents.operator.requests import COMMAND, VELOCITY
from cellwright.rendering.scene import Scene
from cellwright.viewer.services.cell_panel import CellPanel
from cellwright.viewer.web.cell_operator.feature import TAB, CellOperator
from cellwright.viewer.web.input import Input
from tests.support.waiting import wait_until
from tests.viewer.web.cell_operator.fakes import FakeLink, report
from tests.viewer.web.operator.fakes import FakeGui, FakeScene

SCENE = Scene("cell", ("world",), (), ())
NONE = (0.0,) * 6


class OperatorPage:
    """Page of a cell, as far as the operator needs one."""

    root = "/scene"

    def __init__(self) -> None:
        self.link = FakeLink()
        self.first_panel: dict[str, Any] = {}
        self.tabs: list[str] = []
        self.server = SimpleNamespace(gui=FakeGui(), scene=FakeScene())

    def tab(self, name: str) -> Any:
        self.tabs.append(name)
        return nullcontext()

    def panel(self, **changes: Any) -> dict[str, Any]:
        return {**CellPanel(self.link.cell).panel(), "operator": report(**changes)}


@pytest.fixture
def page() -> OperatorPage:
    return OperatorPage()


@pytest.fixture
def operator(page: OperatorPage) -> Iterator[CellOperator]:
    operator = CellOperator()
    operator.page = page  # type: ignore[assignment]
    operator.on_scene(SCENE)
    yield operator
    if operator._sender is not None:
        operator._sender.close()


def press(*pressed: str, x: float = 0.0) -> Input:
    return Input((x, *NONE[1:]), list(pressed), False)


def test_page_of_a_cell_without_an_operator_stays_empty(page: OperatorPage, operator: CellOperator) -> None:
    operator.panel(CellPanel(page.link.cell).panel())
    operator.panel({**page.panel(), "kind": "recording"})
    operator.on_input(press("stop"))
    assert page.tabs == []
    assert page.server.gui.made == []
    assert page.link.sent == []


def test_operator_appears_with_the_first_report(page: OperatorPage, operator: CellOperator) -> None:
    operator.panel(page.panel())
    assert set(page.tabs) == {TAB}
    handle = page.server.scene.find("transform_controls", "/scene/operator/0/handle")
    assert handle.visible
    operator.on_disconnect("gone")
    assert not handle.visible


def test_strange_report_is_said(page: OperatorPage, operator: CellOperator) -> None:
    operator.panel({**page.panel(), "operator": {"arms": 1}})
    assert "no report of this version" in operator._note


def test_end_of_the_run_hides_the_handles(page: OperatorPage, operator: CellOperator) -> None:
    operator.panel(page.panel())
    operator.panel({**page.panel(), "result": {"outcome": "done"}})
    assert not page.server.scene.find("transform_controls", "/scene/operator/0/handle").visible


def test_other_scene_gets_other_handles(page: OperatorPage, operator: CellOperator) -> None:
    operator.panel(page.panel())
    before = list(page.server.gui.made)
    page.server.scene.made.clear()
    operator.on_scene(SCENE)
    operator.panel(page.panel())
    assert page.server.scene.find("transform_controls", "/scene/operator/0/handle").visible
    assert before[0].is_removed


def test_keys_jog_and_each_press_counts_once(page: OperatorPage, operator: CellOperator) -> None:
    operator.panel(page.panel())
    page.link.sent.clear()
    for _ in range(3):
        operator.on_input(press("home", "grip"))
    operator.on_input(press(x=1.0))

    def topics() -> list[str]:
        return [topic for topic, _ in page.link.sent]

    wait_until(lambda: VELOCITY in topics(), "velocity", seen=topics)
    assert topics() == ["/ariac/gripper/control", COMMAND, VELOCITY]
