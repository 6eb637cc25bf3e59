"""Handles as pose commands: nothing jumps, nothing creeps, and a released one sends nothing."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.util.pose import Pose, normalized
from cellwright.viewer.web.operator.moves import HAND_PERIOD, HAND_REPEAT, Hands
from cellwright.viewer.web.operator.robot_state import RobotState, rotation_angle
from tests.viewer.web.operator.robots import state

ME, OTHER = 1, 2
METRES = st.floats(-5.0, 5.0)
POSES = st.builds(
    lambda position, quaternion: Pose(position, normalized(quaternion)),
    st.tuples(METRES, METRES, METRES),
    st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: math.hypot(*q) > 0.1),
)


def same(one: Pose, other: Pose, tolerance: float = 1e-6) -> bool:
    return math.dist(one.position, other.position) < tolerance and rotation_angle(one, other) < 1e-3


def held(at: Pose, standing_: RobotState, arm: int = 0) -> Hands:
    hands = Hands(2)
    assert hands.grab(arm, ME, at, standing_) == ""
    return hands


@given(POSES, POSES, POSES)
def test_grab_of_handle_anywhere_moves_nothing(handle: Pose, tip: Pose, reference: Pose) -> None:
    robot_state = state(tips=(tip, tip), references=(reference, reference))
    hands = held(handle, robot_state)
    assert hands.due(robot_state, 0.0) is None, "nothing is sent before it moves"
    assert hands.move(0, ME, handle, 0.0)
    sent = hands.due(robot_state, 0.0)
    assert sent is not None
    assert same(reference @ sent[0], tip, 1e-5)


@given(POSES, POSES, POSES)
def test_handle_at_tip_moves_tip_to_its_pose(tip: Pose, put: Pose, reference: Pose) -> None:
    robot_state = state(tips=(tip, tip), references=(reference, reference))
    hands = held(tip, robot_state)
    hands.move(0, ME, put, 0.0)
    sent = hands.due(robot_state, 0.0)
    assert sent is not None
    assert same(reference @ sent[0], put, 1e-5), "there and back between the world and the reference"


@given(POSES, st.tuples(METRES, METRES, METRES))
def test_handle_along_world_axes_moves_and_turns_tip_along_them(tip: Pose, offset: tuple[float, ...]) -> None:
    robot_state = state(tips=(tip, tip))
    hands = held(Pose(tip.position), robot_state)
    x, y, z = (at + step for at, step in zip(tip.position, offset, strict=True))
    turn = Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, 0.5))
    hands.move(0, ME, Pose((x, y, z), turn.quaternion), 0.0)
    requested = hands.held(0)
    assert requested is not None
    assert same(requested, Pose((x, y, z), (turn @ Pose(quaternion=tip.quaternion)).quaternion), 1e-6)


def test_other_hand_keeps_pose_despite_later_measurements() -> None:
    robot_state = state()
    hands = held(robot_state.tips[0], robot_state)
    sent = []
    for step in range(5):
        sagging = state(tips=tuple(Pose((0.0, 0.0, -0.01 * step)) @ tip for tip in robot_state.tips))
        hands.move(0, ME, Pose((0.01 * step, 0.0, 0.0)) @ robot_state.tips[0], step * HAND_PERIOD)
        sent.append(hands.due(sagging, step * HAND_PERIOD))
    lefts = {poses[1] for poses in sent if poses is not None}
    assert len(lefts) == 1
    assert same(robot_state.references[1] @ lefts.pop(), robot_state.tips[1])


def test_other_hand_keeps_its_target() -> None:
    robot_state = state()
    aim = Pose((0.0, 0.0, 0.2)) @ robot_state.tips[1]
    robot_state = state(aims=(None, aim))
    hands = held(robot_state.tips[0], robot_state)
    hands.move(0, ME, robot_state.tips[0], 0.0)
    sent = hands.due(robot_state, 0.0)
    assert sent is not None
    assert same(robot_state.references[1] @ sent[1], aim)


def test_servo_error_does_not_make_hand_creep() -> None:
    robot_state = state()
    aim = Pose((0.002, 0.0, 0.0)) @ robot_state.tips[0]
    hands = held(robot_state.tips[0], state(aims=(aim, None)))
    hands.move(0, ME, robot_state.tips[0], 0.0)
    assert hands.held(0) == pytest.approx(aim) or same(hands.held(0) or Pose(), aim)
    far = Pose((0.1, 0.0, 0.0)) @ robot_state.tips[0]
    hands = held(robot_state.tips[0], state(aims=(far, None)))
    hands.move(0, ME, robot_state.tips[0], 0.0)
    assert same(hands.held(0) or Pose(), robot_state.tips[0]), "a hand under way begins at its present pose"


def test_both_hands_are_dragged_at_once() -> None:
    robot_state = state()
    hands = held(robot_state.tips[0], robot_state)
    assert hands.grab(1, OTHER, robot_state.tips[1], robot_state) == ""
    for arm, browser in ((0, ME), (1, OTHER)):
        hands.move(arm, browser, Pose((0.0, 0.0, 0.1)) @ robot_state.tips[arm], 0.0)
    sent = hands.due(robot_state, 0.0)
    assert sent is not None
    for arm in (0, 1):
        moved = robot_state.references[arm] @ sent[arm]
        assert np.subtract(moved.position, robot_state.tips[arm].position) == pytest.approx([0.0, 0.0, 0.1], abs=1e-6)
    hands.release(0, ME)
    sent = hands.due(robot_state, 1.0)
    assert sent is not None
    assert same(robot_state.references[0] @ sent[0], robot_state.tips[0]), "it stays, while the other is held on"


def test_held_hand_refuses_other_browser() -> None:
    robot_state = state()
    hands = held(robot_state.tips[0], robot_state)
    assert "another browser" in hands.grab(0, OTHER, robot_state.tips[0], robot_state)
    assert not hands.move(0, OTHER, robot_state.tips[1], 0.0)
    hands.release(0, OTHER)
    assert 0 in hands.holds
    assert "unknown arm 7" in hands.grab(7, ME, robot_state.tips[0], robot_state)


def test_drag_sends_at_most_50_poses_per_second_until_release() -> None:
    robot_state = state()
    hands = held(robot_state.tips[0], robot_state)
    count = 0
    for millisecond in range(1000):
        hands.move(0, ME, Pose((1e-4 * millisecond, 0.0, 0.0)) @ robot_state.tips[0], millisecond / 1000)
        count += hands.due(robot_state, millisecond / 1000) is not None
    assert 45 <= count <= 51
    hands.release(0, ME)
    assert hands.due(robot_state, 2.0) is None
    assert not hands.holds


def test_resting_handle_repeats_pose_for_limited_time() -> None:
    robot_state = state()
    hands = held(robot_state.tips[0], robot_state)
    hands.move(0, ME, robot_state.tips[0], 10.0)
    assert hands.due(robot_state, 10.0)
    assert hands.due(robot_state, 10.0 + HAND_REPEAT - 0.1), "the way may take some time"
    assert hands.due(robot_state, 10.0 + HAND_REPEAT + 0.1) is None, "a browser that is gone looks the same"
    hands.move(0, ME, robot_state.tips[0], 20.0)
    assert hands.due(robot_state, 20.0)


def test_discarded_requests_end_hold() -> None:
    robot_state = state()
    hands = held(robot_state.tips[0], robot_state)
    hands.move(0, ME, robot_state.tips[1], 0.0)
    assert hands.forget()
    assert not hands.forget()
    assert not hands.move(0, ME, robot_state.tips[1], 1.0), "the hand on the mouse is to open first"
    assert hands.due(robot_state, 1.0) is None
    assert hands.held(0) is None
