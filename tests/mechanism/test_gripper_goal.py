"""Goals of a parallel gripper: how they end, what they report, and what is rejected."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.gripper import ParallelGripperSettings
from cellwright.mechanism.gripper_goal import GripperGoals, GripperRequest, width_of
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
    rig.run(1.5)
    assert ended == ["before"]


@pytest.mark.parametrize(("asked", "given_"), [(0.0, 40.0), (-1.0, 40.0), (15.0, 15.0), (1000.0, 40.0)])
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
    assert width_of([], [position], JOINTS) == width_of(["right"], [position], JOINTS) == 2 * position
    assert width_of(JOINTS, [position, position], JOINTS) == 2 * position


@pytest.mark.parametrize(
    ("names", "positions"), [(["elbow"], [0.1]), (["left", "left"], [0.1, 0.1]), (["left"], []), ([], [0.1, 0.1])]
)
def test_command_for_other_joints_is_rejected(names: list[str], positions: list[float]) -> None:
    with pytest.raises(RejectedCommandError, match="got"):
        width_of(names, positions, JOINTS)
