"""Requests of an operator, as messages and back."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.interface.rows import GEAR, OPERATOR
from cellwright.clients.agents.operator.requests import (
    COMMAND,
    JOINTS,
    POSE,
    REPORT,
    REQUESTS,
    VELOCITY,
    Command,
    JointVelocity,
    ToJoints,
    ToPose,
    Velocity,
    joints_request,
    pose_request,
    read_request,
    velocity_request,
)
from cellwright.middleware.messages.conversions import header, joint_state, origin, pose_message
from cellwright.middleware.messages.standard import PoseStamped, String, TwistStamped
from cellwright.util.errors import MessageError
from cellwright.util.pose import Pose, Vector3

ZERO = (0.0, 0.0, 0.0)
numbers = st.floats(-5.0, 5.0)
vectors = st.tuples(numbers, numbers, numbers)


@given(position=vectors, angles=st.tuples(*[st.floats(-1.5, 1.5)] * 3))
def test_pose_request_is_read_as_written(position: Vector3, angles: Vector3) -> None:
    pose = Pose.from_rpy(position, angles)
    found = read_request(POSE, pose_request(pose))
    assert isinstance(found, ToPose)
    assert found.world_T_tool.position == position
    assert found.world_T_tool.quaternion == pytest.approx(pose.quaternion)


@given(linear=vectors, angular=vectors)
def test_velocity_request_is_read_as_written(linear: Vector3, angular: Vector3) -> None:
    assert read_request(VELOCITY, velocity_request(linear, angular, "tool")) == Velocity(linear, angular, "tool")


def test_joints_request_has_positions_or_velocities() -> None:
    assert read_request(JOINTS, joints_request({"a": 1.0, "b": 2.0})) == ToJoints({"a": 1.0, "b": 2.0})
    assert read_request(JOINTS, joints_request(velocities={"a": 0.5})) == JointVelocity({"a": 0.5})


@pytest.mark.parametrize("text", ["home", "upright on", "belt  off", "arm left", "stop"])
def test_command_is_a_name_and_a_word(text: str) -> None:
    name, _, word = text.partition(" ")
    assert read_request(COMMAND, String(text)) == Command(name, word.strip())


@pytest.mark.parametrize(
    ("topic", "message", "why"),
    [
        (POSE, PoseStamped(header("base"), origin()), "frame_id must be world"),
        (POSE, PoseStamped(header(), pose_message(Pose((60.0, 0.0, 0.0)))), "within 50 m"),
        (POSE, PoseStamped(header(), pose_message(Pose((float("nan"), 0.0, 0.0)))), "finite"),
        (VELOCITY, velocity_request((float("inf"), 0.0, 0.0)), "finite"),
        (VELOCITY, TwistStamped(header("belt"), velocity_request(ZERO).twist), "frame_id must be world or tool"),
        (JOINTS, joint_state(["a"], [1.0], [1.0]), "a position or a velocity"),
        (JOINTS, joint_state([], []), "a position or a velocity"),
        (JOINTS, joint_state(["a"], [float("nan")]), "finite"),
        (COMMAND, String("jump"), "unknown .got 'jump'.; give one of start"),
        (COMMAND, String("upright maybe"), "upright on|off"),
        (COMMAND, String("arm"), "arm NAME"),
    ],
)
def test_senseless_request_is_refused(topic: str, message: Any, why: str) -> None:
    with pytest.raises(MessageError, match=why):
        read_request(topic, message)


def test_topics_are_those_of_the_cell() -> None:
    assert {row.name for row in GEAR if row.name.startswith(OPERATOR)} == {*REQUESTS, REPORT}
