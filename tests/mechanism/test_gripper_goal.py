"""Goals of a parallel gripper: how they end, what they report, and what is rejected."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.gripper import ParallelGripperSettings
from cellwright.mechanism.gripper_goal import GripperGoals, GripperRequest, JointCommand, request_of_joints
from cellwright.mechanism.trajectory_goal import GoalStatus
from cellwright.util.errors import RejectedCommandError
from tests.mechanism.gripper_rig import PART, Load, Rig

JOINTS = ("left", "right")
MM = 1e-3


def goals_of(load: Load | None) -> tuple[Rig, GripperGoals, list[str]]:
    """A rig, the goals of its gripper, and the identifiers of those that ended."""
    rig = Rig(ParallelGripperSettings(), load)
    goals = GripperGoals(rig.gripper)
    ended: list[str] = []
    goals.on_ended.append(lambda goal: ended.append(goal.goal_id))
    return rig, goals, ended


def test_goal_without_a_part_reaches_its_width() -> None:
    rig, goals, ended = goals_of(None)
    goals.accept(GripperRequest("a", 0.06))
    assert goals.active is not None
    rig.run(1.0)
    assert ended == ["a"]
    assert goals.goal is not None
    assert goals.goal.status is GoalStatus.SUCCEEDED
    result = goals.goal.result
    assert result is not None
    assert (result.reached_goal, result.stalled) == (True, False)
    assert result.position == pytest.approx(0.06, abs=0.5 * MM)


def test_goal_that_grips_a_part_succeeds_stalled() -> None:
    rig, goals, ended = goals_of(Load())
    goals.accept(GripperRequest("a", 0.0, max_effort=25.0))
    rig.run(1.2)
    assert ended == ["a"]
    assert rig.gripper.part == PART
    assert goals.goal is not None
    result = goals.goal.result
    assert result is not None
    assert goals.goal.status is GoalStatus.SUCCEEDED
    assert (result.reached_goal, result.stalled) == (False, True)
    assert result.position == pytest.approx(0.04, abs=0.5 * MM)
    assert result.effort == pytest.approx(25.0, rel=0.02)


def test_goal_at_the_present_width_ends_at_once() -> None:
    rig, goals, ended = goals_of(None)
    goals.accept(GripperRequest("a", 0.1))
    rig.run(0.02)
    assert ended == ["a"]


def test_report_while_moving_has_position_and_speed() -> None:
    rig, goals, _ = goals_of(None)
    goals.accept(GripperRequest("a", 0.0, max_speed=0.05))
    rig.run(0.4)
    report = goals.report()
    assert (report.reached_goal, report.stalled) == (False, False)
    assert report.position == pytest.approx(0.08, abs=MM)
    assert report.speed == pytest.approx(-0.05, rel=0.05)


def test_new_goal_ends_the_one_before() -> None:
    rig, goals, ended = goals_of(None)
    first = goals.accept(GripperRequest("a", 0.0))
    rig.run(0.1)
    assert first.status is GoalStatus.ACTIVE
    goals.accept(GripperRequest("b", 0.09))
    assert ended == ["a"]
    rig.run(1.0)
    assert ended == ["a", "b"]


def test_other_command_ends_the_goal() -> None:
    rig, goals, ended = goals_of(None)
    goals.accept(GripperRequest("a", 0.0))
    rig.run(0.1)
    rig.gripper.open()
    assert ended == ["a"]
    assert goals.goal is not None
    assert goals.goal.status is GoalStatus.PREEMPTED


def test_command_moves_the_fingers_and_ends_the_goal() -> None:
    rig, goals, ended = goals_of(None)
    goals.accept(GripperRequest("a", 0.0))
    rig.run(0.1)
    goals.command(GripperRequest("", 0.0))  # the same again is a command all the same
    assert ended == ["a"]
    goals.command(GripperRequest("", 0.06, 15.0))
    rig.run(1.0)
    assert ended == ["a"]
    assert rig.gripper.read().width == pytest.approx(0.06, abs=0.5 * MM)
    assert rig.gripper.max_force == 15.0


def test_cancelled_goal_stops_the_fingers() -> None:
    rig, goals, ended = goals_of(None)
    goals.accept(GripperRequest("a", 0.0))
    rig.run(0.3)
    assert goals.cancel()
    rig.run(1.0)
    assert ended == ["a"]
    assert rig.gripper.read().width == pytest.approx(0.07, abs=2 * MM)
    assert not goals.cancel()


def test_cancelled_goal_keeps_the_part() -> None:
    rig, goals, _ = goals_of(Load())
    goals.accept(GripperRequest("a", 0.0))
    rig.run(1.0)
    rig.lift()
    goals.accept(GripperRequest("b", 0.01))
    assert goals.cancel()
    rig.run(0.5)
    assert rig.gripper.part == PART


@pytest.mark.parametrize(
    "request_",
    [
        GripperRequest("a", 0.2),
        GripperRequest("a", -0.01),
        GripperRequest("a", float("nan")),
        GripperRequest("a", 0.0, float("nan")),
        GripperRequest("a", 0.0, -1.0),
        GripperRequest("a", 0.0, 1.0, -0.1),
        GripperRequest("a", 0.0, 1.0, float("inf")),
    ],
)
def test_goal_out_of_range_is_rejected_and_changes_nothing(request_: GripperRequest) -> None:
    rig, goals, ended = goals_of(None)
    goals.accept(GripperRequest("before", 0.0))
    with pytest.raises(RejectedCommandError, match=r"goal 'a': .* \(got"):
        goals.accept(request_)
    assert goals.active is not None
    assert goals.active.goal_id == "before"
    with pytest.raises(RejectedCommandError, match=r"^(?!goal).* \(got"):
        goals.command(replace(request_, goal_id=""))
    assert goals.active is not None
    rig.run(1.5)
    assert ended == ["before"]


@pytest.mark.parametrize(("asked", "given_"), [(0.0, 40.0), (15.0, 15.0), (1000.0, 40.0)])
def test_force_is_limited_to_the_grippers_own(asked: float, given_: float) -> None:
    rig, goals, _ = goals_of(None)
    assert goals.accept(GripperRequest("a", 0.0, asked)).max_force == given_
    assert rig.gripper.max_force == given_


def test_width_that_was_read_at_an_end_may_be_sent_again() -> None:
    _, goals, _ = goals_of(None)
    assert goals.accept(GripperRequest("a", -0.0001)).width == 0.0
    assert goals.accept(GripperRequest("b", 0.1001)).width == 0.1


def test_state_of_active_and_ended_goal_is_restored() -> None:
    rig, goals, _ = goals_of(None)
    states: list[Any] = [goals.get_state()]
    goals.accept(GripperRequest("a", 0.05))
    states.append(goals.get_state())
    rig.run(1.0)
    states.append(goals.get_state())
    for state in states:
        goals.set_state(state)
        assert goals.get_state() == state
    goals.reset()
    assert goals.get_state() == states[0]


@given(st.floats(0.0, 0.25))
def test_one_finger_of_a_command_means_twice_its_position(position: float) -> None:
    asked = [
        request_of_joints("a", JointCommand(names, [position] * max(len(names), 1)), JOINTS)
        for names in ([], ["right"], JOINTS, ["right", "left"])
    ]
    assert asked == [GripperRequest("a", 2 * position)] * 4


def test_finger_with_a_limit_of_0_has_that_of_the_other() -> None:
    command = JointCommand(JOINTS, [0.02, 0.02], [0.0, 0.0], [0.0, 10.0])
    assert request_of_joints("a", command, JOINTS) == GripperRequest("a", 0.04, 20.0, 0.0)


@pytest.mark.parametrize("count", [1, 2])
def test_speed_and_effort_of_a_finger_are_half_of_the_grippers(count: int) -> None:
    command = JointCommand(JOINTS[:count], [0.02] * count, [0.03] * count, [12.0, 10.0][:count])
    assert request_of_joints("a", command, JOINTS) == GripperRequest("a", 0.04, 24.0 if count == 1 else 20.0, 0.06)


@pytest.mark.parametrize(
    ("command", "reason"),
    [
        (JointCommand(["elbow"], [0.1]), "joints must be left or right, each once .got elbow"),
        (JointCommand(["left", "left"], [0.1, 0.1]), "each once .got left, left"),
        (JointCommand(["left"], []), "a position is needed for each joint .got 0 for 1"),
        (JointCommand([], [0.1, 0.1]), "a position is needed for each joint .got 2 for 1"),
        (JointCommand(["left"], [0.1], velocities=[0.1, 0.1]), "a velocity is needed for each joint .got 2 for 1"),
        (JointCommand(JOINTS, [0.1, 0.1], efforts=[1.0]), "an effort is needed for each joint .got 1 for 2"),
        (JointCommand(JOINTS, [0.01, 0.02]), "same distance from the middle .got 0.01 and 0.02 m"),
    ],
)
def test_command_for_other_joints_is_rejected(command: JointCommand, reason: str) -> None:
    with pytest.raises(RejectedCommandError, match=reason):
        request_of_joints("a", command, JOINTS)


@pytest.mark.parametrize("field", ["positions", "velocities", "efforts"])
@pytest.mark.parametrize("value", [float("nan"), float("inf"), -1.0])
def test_finger_with_an_invalid_number_is_rejected(field: str, value: float) -> None:
    _, goals, _ = goals_of(None)
    for given_ in ([value], [value, 0.02], [0.02, value]):
        numbers: dict[str, Any] = {"positions": [0.02] * len(given_), field: given_}
        with pytest.raises(RejectedCommandError, match="got"):
            goals.accept(request_of_joints("a", JointCommand(JOINTS[: len(given_)], **numbers), JOINTS))
    assert goals.goal is None
