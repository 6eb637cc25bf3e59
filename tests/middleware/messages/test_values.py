"""Messages as JSON values: what comes back is what was sent, missing fields have defaults, wrong ones are refused."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.messages import TYPES, control_msgs
from cellwright.middleware.messages.conversions import header, trajectory_point
from cellwright.middleware.messages.types import MAX_TRAILING
from cellwright.util.errors import MessageError

ROS2 = TYPES.encodings["ros2"]
_NUMBERS = st.lists(st.floats(-1e6, 1e6), max_size=4)


@given(names=st.lists(st.text(max_size=8), max_size=4), desired=_NUMBERS, actual=_NUMBERS, now=st.integers(0, 10**15))
def test_feedback_comes_back_as_sent(names: list[str], desired: list[float], actual: list[float], now: int) -> None:
    points = [trajectory_point(each, each, time_from_start=now) for each in (desired, actual, desired)]
    sent = control_msgs.FollowJointTrajectoryFeedback(header("world", now), names, *points)
    assert TYPES.to_cdr(ROS2.read(ROS2.write(sent), control_msgs.FollowJointTrajectoryFeedback)) == TYPES.to_cdr(sent)


def test_state_has_names_and_additions_of_ros2() -> None:
    points = [trajectory_point(each) for each in ([1.0, 2.0], [1.5, 2.5], [-0.5, -0.5])]
    values = json.loads(ROS2.write(control_msgs.JointTrajectoryControllerState(header("", 0), ["a", "b"], *points)))
    assert (values["output"], values["speed_scaling_factor"]) == ({"positions": [1.0, 2.0]}, 1.0)
    assert {"reference", "feedback", "error"} <= set(values)
    assert not {"desired", "actual"} & set(values)
    response = TYPES.own["control_msgs/srv/QueryTrajectoryState_Response"]
    assert json.loads(ROS2.write(response()))["success"] is True


def test_missing_fields_have_defaults_and_empty_unknown_ones_are_ignored() -> None:
    values = {
        "goal_id": {"id": "a"},
        "goal": {"multi_dof_trajectory": {"joint_names": []}, "component_path_tolerance": []},
    }
    goal = TYPES.from_ros2(json.dumps(values).encode(), control_msgs.FollowJointTrajectoryActionGoal)
    assert goal.goal_id.id == "a"
    assert goal.goal.trajectory.points == []
    assert goal.header.stamp.sec == 0


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"goal": {"multi_dof_trajectory": {"joint_names": ["base"]}}}, "goal.multi_dof_trajectory is not supported"),
        ({"goal": {"trajectory": 3}}, r"goal.trajectory must be an object \(got 3\)"),
        ({"goal": {"trajectory": {"joint_names": [1]}}}, "joint_names"),
        ([], "must be an object"),
    ],
)
def test_wrong_values_are_refused_with_their_place(values: object, reason: str) -> None:
    with pytest.raises(MessageError, match=reason):
        TYPES.from_ros2(json.dumps(values).encode(), control_msgs.FollowJointTrajectoryActionGoal)


@given(st.binary(max_size=64))
def test_any_bytes_are_read_or_refused(data: bytes) -> None:
    for name in ("control_msgs/FollowJointTrajectoryActionGoal", "sensor_msgs/JointState"):
        try:
            ROS2.read(data, TYPES.message(name))
        except MessageError:
            continue


@given(extra=st.integers(0, MAX_TRAILING + 3), text=st.text(max_size=9))
def test_bytes_without_meaning_at_the_end_are_ignored(extra: int, text: str) -> None:
    sent = TYPES.message("std_msgs/String")(text)  # type: ignore[call-arg]
    assert ROS2.read(ROS2.write(sent) + bytes(extra), type(sent)) == sent


def test_more_bytes_at_the_end_are_refused() -> None:
    sent = TYPES.message("std_msgs/String")("a")  # type: ignore[call-arg]
    with pytest.raises(MessageError, match="size mismatch"):
        ROS2.read(ROS2.write(sent) + bytes(MAX_TRAILING + 8), type(sent))
