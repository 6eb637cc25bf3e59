"""Operator on a page: only for a robot."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from cellwright.rendering.scene import Scene
from cellwright.robot.node import RobotNode
from cellwright.viewer.services.names import PANEL
from cellwright.viewer.web.operator.feature import TAB, Operator
from tests.clients.operators.nodes import robot
from tests.support.waiting import wait_until
from tests.viewer.web.operator.fakes import FakePage
from tests.viewer.web.operator.robots import served

SCENE = Scene("two arms", ("world",), (), ())


@pytest.fixture(scope="module")
def address() -> Iterator[tuple[str, int]]:
    node = RobotNode(robot())
    with served(node) as address:
        yield address
    node.close()


def built(operator: Operator, page: Any) -> None:
    def is_built() -> bool:
        operator.on_frame({})
        return bool(page.server.gui.made)

    wait_until(is_built, "panel of the operator")


def test_operator_of_cell_page_stays_empty() -> None:
    operator, page = Operator(), FakePage(("127.0.0.1", 1))
    operator.page = page  # type: ignore[assignment]
    operator.on_scene(SCENE)
    operator.panel({"kind": "cell"})
    operator.on_frame({})
    assert page.tabs == []
    assert page.server.gui.made == []


def test_operator_of_robot_has_tab_and_renews_handles_with_scene(address: tuple[str, int]) -> None:
    operator, page = Operator(), FakePage(address)
    page.first_panel = page.link.ask(PANEL)
    operator.page = page  # type: ignore[assignment]
    operator.on_scene(SCENE)
    assert page.tabs == [TAB], "it is there before those of others"
    built(operator, page)
    assert set(page.tabs) == {TAB}
    scene, gui = page.server.scene, page.server.gui
    assert scene.find("transform_controls", "/scene/operator/1/handle").visible
    operator.on_disconnect("gone")
    assert not scene.find("transform_controls", "/scene/operator/1/handle").visible
    scene.made.clear()
    gui_before = list(gui.made)
    operator.on_scene(SCENE)

    def has_handles() -> bool:
        operator.on_frame({})
        return bool(scene.find("transform_controls", "/scene/operator/1/handle").visible)

    wait_until(has_handles, "robot that is heard from again")
    assert gui_before[0].is_removed
    assert operator._worker is not None
    operator._worker.close()
    page.link.close()
