"""Robot and state from a panel that comes over the network."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.robot.node import RobotNode
from cellwright.util.errors import MessageError
from cellwright.viewer.services.robot_panel import RobotPanel
from cellwright.viewer.web.operator.robot_state import FULL_TURN, RobotState, SeenRobot, pose_of
from tests.robot.robots import two_arms
from tests.viewer.web.operator.robots import number, seen, state


def test_robot_and_state_are_read_from_panel() -> None:
    robot, robot_state = seen(), state()
    assert robot.joints[number("left_finger")].unit == "m"
    assert robot.arms == robot.grippers == ("right", "left")
    assert robot.base_mode == "original"
    assert len(robot_state.positions) == len(robot.joints)
    assert robot_state.tips[0].position[1] == pytest.approx(-0.3, abs=1e-3)
    assert robot_state.why_not == ""


def test_why_not_has_reason_for_each_hold() -> None:
    assert state(is_stopped=True, is_enabled=False).why_not == "the emergency stop is active"
    assert state(is_enabled=False).why_not == "it is not enabled"
    assert state(is_homing=True).why_not == "it is moving home"


def test_joint_without_limits_has_full_turn_each_way() -> None:
    robot = SeenRobot.read(RobotPanel(RobotNode(two_arms())).state({}))
    wheel = next(joint for joint in robot.joints if joint.name == "wheel")
    assert (wheel.lower, wheel.upper) == (-FULL_TURN, FULL_TURN)


@given(st.floats(allow_nan=False))
def test_clamped_position_is_within_limits(value: float) -> None:
    joint = number("right_2")
    assert -2.0 <= seen().clamped(joint, value) <= 2.0


@pytest.mark.parametrize("broken", [{}, {"robot": None}, {"robot": {"joints": 3}}, {"kind": "cell", "score": 1}])
def test_panel_without_robot_is_refused(broken: dict[str, Any]) -> None:
    with pytest.raises(MessageError, match="has no robot"):
        SeenRobot.read({"name": "x", "digest": "y", **broken})
    with pytest.raises(MessageError, match="has no robot"):
        RobotState.read(broken)


@pytest.mark.parametrize(
    "numbers",
    [
        (0, 0, 0, 0, 0, 0, 0),
        (0, 0, math.nan, 1, 0, 0, 0),
        (0, math.inf, 0, 1, 0, 0, 0),
        (0, 0, 0),
        ("a",) * 7,
        5,
        (0, 0, 0, 1, 0, 0, None),
    ],
)
def test_invalid_pose_is_refused(numbers: Any) -> None:
    with pytest.raises(ValueError, match=r"pose|float|unpack"):
        pose_of(numbers)


def test_pose_has_unit_quaternion() -> None:
    assert pose_of([1, 2, 3, 0, 0, 0, 5]).quaternion == (0.0, 0.0, 0.0, 1.0)
