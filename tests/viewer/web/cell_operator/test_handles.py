"""Handles at the tools of a cell's arms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cellwright.clients.agents.operator.requests import POSE, ToPose, read_request
from cellwright.util.pose import Pose
from cellwright.viewer.web.cell_operator.handles import ToolHandles
from cellwright.viewer.web.operator.handles import BESIDE, SHORT
from tests.support.cells import INITIAL
from tests.viewer.web.cell_operator.fakes import KeepingSender, arms, state
from tests.viewer.web.operator.fakes import FakeScene

ME, OTHER = 3, 4
TOOL = arms()["arm"].world_T_tool(INITIAL)


@pytest.fixture
def scene() -> FakeScene:
    return FakeScene()


@pytest.fixture
def sender() -> KeepingSender:
    return KeepingSender()


@pytest.fixture
def handles(scene: FakeScene, sender: KeepingSender) -> ToolHandles:
    handles = ToolHandles(scene, "/scene", arms(), sender)
    handles.show(state())
    return handles


def handle(scene: FakeScene) -> Any:
    return scene.find("transform_controls", "/scene/operator/0/handle")


def poses(sender: KeepingSender) -> list[Pose]:
    """Poses of the tool that were asked for."""
    found = [read_request(topic, message) for topic, message in sender.given if topic == POSE]
    return [each.world_T_tool for each in found if isinstance(each, ToPose)]


def test_handle_is_at_the_tool_and_hidden_while_stopped(scene: FakeScene, handles: ToolHandles) -> None:
    assert handle(scene).visible
    assert handle(scene).position == pytest.approx(TOOL.position)
    handles.show(state(stopped=True))
    assert not handle(scene).visible
    handles.show(None)
    assert not handle(scene).visible


@pytest.mark.usefixtures("handles")
def test_drag_moves_the_tool_by_as_much(scene: FakeScene, sender: KeepingSender) -> None:
    one = handle(scene)
    begin = np.array(one.position)
    one.use(ME, "start")
    one.use(ME, "update", position=begin + np.array((0.1, 0.0, -0.2)))
    (pose,) = poses(sender)
    assert pose.position == pytest.approx(np.array(TOOL.position) + np.array((0.1, 0.0, -0.2)))
    assert pose.quaternion == pytest.approx(TOOL.quaternion)


def test_held_handle_stays_where_it_is_put(scene: FakeScene, handles: ToolHandles) -> None:
    one = handle(scene)
    put = np.array(one.position) + np.array((0.1, 0.0, 0.0))
    one.use(ME, "start")
    one.use(ME, "update", position=put)
    handles.show(state())
    assert one.position == pytest.approx(put)
    one.use(ME, "end")
    handles.show(state())
    assert one.position == pytest.approx(TOOL.position)


@pytest.mark.usefixtures("handles")
def test_handle_belongs_to_the_browser_that_took_it(scene: FakeScene, sender: KeepingSender) -> None:
    one = handle(scene)
    one.use(ME, "start")
    one.use(OTHER, "start")
    one.use(OTHER, "update", position=np.array((9.0, 9.0, 9.0)))
    assert poses(sender) == []
    one.use(OTHER, "end")
    one.use(ME, "update", position=np.array((0.0, 0.0, 1.0)))
    assert len(poses(sender)) == 1


def test_stop_ends_a_drag(scene: FakeScene, sender: KeepingSender, handles: ToolHandles) -> None:
    one = handle(scene)
    one.use(ME, "start")
    handles.show(state(stopped=True))
    handles.show(state())
    one.use(ME, "update", position=np.array((0.0, 0.0, 1.0)))
    assert poses(sender) == []


@pytest.mark.usefixtures("handles")
def test_senseless_drags_are_ignored(scene: FakeScene, sender: KeepingSender) -> None:
    one = handle(scene)
    one.use(ME, "start")
    one.use(ME, "update", position=np.array((float("nan"), 0.0, 0.0)))
    one.use(ME, "update", position=np.array((99.0, 0.0, 0.0)))
    assert poses(sender) == []


def test_other_arm_is_chosen_by_its_handle(scene: FakeScene, sender: KeepingSender, handles: ToolHandles) -> None:
    handles.show(state(arm="another"))
    handle(scene).use(ME, "start")
    assert sender.given == [("command", "arm arm")]


def test_ghost_shows_the_aim_and_whether_it_is_in_reach(scene: FakeScene, handles: ToolHandles) -> None:
    ghost = scene.find("icosphere", "/scene/operator/0/ghost")
    assert not ghost.visible
    handles.show(state(aim=[1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]))
    assert (ghost.visible, ghost.color) == (True, BESIDE)
    assert ghost.position == pytest.approx((1.0, 0.0, 1.0))
    handles.show(state(aim=[1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0], why="out of reach"))
    assert ghost.color == SHORT
