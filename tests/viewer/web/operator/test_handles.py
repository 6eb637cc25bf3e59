"""Handles and ghosts: their poses, and drags by a browser."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cellwright.clients.operators.robot import MoveTips
from cellwright.util.pose import Pose
from cellwright.viewer.web.operator.command_queue import CommandQueue
from cellwright.viewer.web.operator.handles import BESIDE, REFUSED, SHORT, Handles
from tests.viewer.web.operator.fakes import FakeHandle, FakeScene
from tests.viewer.web.operator.robots import Clock, seen, state

ME = 3
TIPS = state().tips
AIM = Pose((0.0, 0.0, 0.2)) @ TIPS[0]


@pytest.fixture
def queue() -> CommandQueue:
    queue = CommandQueue(seen(), Clock())
    queue.see(state())
    return queue


@pytest.fixture
def scene() -> FakeScene:
    return FakeScene()


@pytest.fixture
def handles(scene: FakeScene, queue: CommandQueue) -> Handles:
    handles = Handles(scene, "/scene", queue)
    handles.show(queue.state)
    return handles


def part(scene: FakeScene, kind: str, name: str, arm: int = 0) -> Any:
    return scene.find(kind, f"/scene/operator/{arm}/{name}")


def handle(scene: FakeScene, arm: int = 0) -> Any:
    return part(scene, "transform_controls", "handle", arm)


def show(handles: Handles, queue: CommandQueue, **changes: Any) -> None:
    queue.see(state(**changes))
    handles.show(queue.state)


def drag(one: FakeHandle, *positions: Any) -> None:
    one.use(ME, "start")
    for position in positions:
        one.use(ME, "update", position=np.array(position))


def test_handles_are_at_hands_along_world_axes(scene: FakeScene, handles: Handles, queue: CommandQueue) -> None:
    for arm in (0, 1):
        one = handle(scene, arm)
        assert one.visible
        assert one.position == pytest.approx(TIPS[arm].position)
        assert list(one.wxyz) == [1.0, 0.0, 0.0, 0.0]
    handles.along_hand = True
    handles.show(queue.state)
    assert handle(scene).wxyz == pytest.approx(TIPS[0].quaternion)
    assert not part(scene, "icosphere", "ghost").visible


def test_unchanged_handles_are_not_sent(scene: FakeScene, handles: Handles, queue: CommandQueue) -> None:
    before = [each.sets for each in scene.made]
    for _ in range(10):
        handles.show(queue.state)
    assert [each.sets for each in scene.made] == before


def test_drag_is_sent_and_handle_stays_where_put(scene: FakeScene, handles: Handles, queue: CommandQueue) -> None:
    one = handle(scene)
    drag(one, AIM.position)
    [order] = queue.due()
    assert isinstance(order, MoveTips)
    assert (state().references[0] @ order.tips[0]).position == pytest.approx(AIM.position, abs=1e-6)
    handles.show(queue.state)
    assert one.position == pytest.approx(AIM.position), "it is held"
    ghost = part(scene, "icosphere", "ghost")
    assert ghost.visible
    assert ghost.position == pytest.approx(AIM.position)
    one.use(ME, "end")
    handles.show(queue.state)
    assert one.position == pytest.approx(TIPS[0].position), "let go of, it is where the hand is"


@pytest.mark.parametrize("held", [{"is_stopped": True}, {"is_homing": True}, {"is_enabled": False}])
def test_hold_of_robot_hides_handle(
    scene: FakeScene, handles: Handles, queue: CommandQueue, held: dict[str, bool]
) -> None:
    one = handle(scene)
    drag(one, AIM.position)
    show(handles, queue, **held)
    assert not one.visible
    assert one.position == pytest.approx(TIPS[0].position)
    show(handles, queue)
    assert one.visible
    one.use(ME, "update", position=np.array(AIM.position))
    assert queue.due() == []
    handles.show(queue.state)
    assert one.position == pytest.approx(TIPS[0].position)


def test_ghost_shows_target_from_any_client(scene: FakeScene, handles: Handles, queue: CommandQueue) -> None:
    ghost, words, line = (
        part(scene, kind, name)
        for kind, name in (("icosphere", "ghost"), ("label", "words"), ("line_segments", "line"))
    )
    show(handles, queue, aims=(AIM, None), time=1)
    assert (ghost.visible, tuple(ghost.color), words.visible) == (True, BESIDE, False)
    assert line.points[0] == pytest.approx(np.array([TIPS[0].position, AIM.position]), abs=1e-6)
    assert not part(scene, "icosphere", "ghost", 1).visible
    show(handles, queue, aims=(AIM, None), time=10**9)
    assert (tuple(ghost.color), words.visible, words.text) == (SHORT, True, "out of reach")
    show(handles, queue, aims=(TIPS[0], None), time=2 * 10**9)
    assert (ghost.visible, words.visible) == (False, False)


def test_ghost_shows_refused_pose_in_red(scene: FakeScene, handles: Handles, queue: CommandQueue) -> None:
    drag(handle(scene), AIM.position)
    queue.refused("/vr commands this topic")
    handles.show(queue.state)
    ghost = part(scene, "icosphere", "ghost")
    assert (ghost.visible, tuple(ghost.color)) == (True, REFUSED)
    assert part(scene, "label", "words").text == "refused"
    queue.slide(0, 0.0)
    handles.show(queue.state)
    assert not ghost.visible


@pytest.mark.parametrize(
    ("position", "wxyz"),
    [((np.nan, 0, 0), (1, 0, 0, 0)), ((0, 0), (1, 0, 0, 0)), ((0, 0, 0), (0, 0, 0, 0)), (("x", 0, 0), (1, 0, 0, 0))],
)
def test_invalid_drag_is_ignored(
    scene: FakeScene, handles: Handles, queue: CommandQueue, position: Any, wxyz: Any
) -> None:
    one = handle(scene)
    drag(one, AIM.position)
    queue.due()
    one.use(ME, "update", position=np.array(position), wxyz=np.array(wxyz))
    requested = queue.hands.held(0)
    assert requested is not None
    assert requested.position == pytest.approx(AIM.position)
    one.use(ME, "end")
    handles.show(queue.state)
    assert one.position == pytest.approx(TIPS[0].position), "it is put right"
    assert list(one.wxyz) == [1.0, 0.0, 0.0, 0.0]


def test_handles_of_disconnected_robot_are_hidden(scene: FakeScene, handles: Handles, queue: CommandQueue) -> None:
    show(handles, queue, aims=(AIM, None))
    handles.show(None)
    assert not any(each.visible for each in scene.made)
    handles.is_shown = False
    handles.show(queue.state)
    assert not handle(scene).visible
