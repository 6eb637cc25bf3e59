"""Goals of the arm's controller in the running cell."""

import pytest

from cellwright.config.arm import ArmSettings, JointTolerance
from cellwright.config.trial.trial import CellSettings
from cellwright.mechanism.trajectory_controller import RejectedTrajectoryError
from cellwright.mechanism.trajectory_goal import GoalRequest, GoalResult, GoalStatus, TrajectoryGoal
from cellwright.middleware.messages.control_msgs import JointTolerance as AskedTolerance
from tests.cell.devices.floor import Floor, one_of_each
from tests.cell.devices.test_arm import FREE, INITIAL, MOVED, max_difference, positions, smooth, trajectory


def run_goal(floor: Floor, request: GoalRequest, limit: float = 5.0) -> TrajectoryGoal:
    """Return the goal as listeners got it at its end."""
    ended: list[TrajectoryGoal] = []
    floor.arm.on_goal_ended.append(ended.append)
    try:
        goal = floor.arm.accept(request)
        floor.run_until(lambda: bool(ended), limit)
    finally:
        floor.arm.on_goal_ended.pop()
    assert ended == [goal]
    return goal


def test_goal_succeeds_when_arm_arrives(original: Floor) -> None:
    goal = run_goal(original, GoalRequest("g", smooth(FREE, 1.5)))
    assert (goal.status, goal.result) == (GoalStatus.SUCCEEDED, GoalResult.SUCCESSFUL)
    assert 1.5 <= original.now < 1.8
    original.run(0.5)
    assert max_difference(positions(original)[1:], FREE[1:]) < 5e-3


def test_goal_is_aborted_when_arm_leaves_path(original: Floor) -> None:
    far = (2.0, *INITIAL[1:])
    goal = run_goal(original, GoalRequest("g", trajectory((far, 0.4))))
    assert (goal.status, goal.result) == (GoalStatus.ABORTED, GoalResult.PATH_TOLERANCE_VIOLATED)
    assert goal.reason.startswith("linear_arm_actuator_joint left its path 0.")
    assert original.now < 0.4


def test_goal_is_aborted_when_arm_does_not_arrive(original: Floor) -> None:
    tight = (AskedTolerance("wrist_1_joint", 1e-4),)  # gravity alone takes 2 mrad
    request = GoalRequest("g", smooth(FREE, 1.0), goal_tolerances=tight)
    goal = run_goal(original, request)
    assert (goal.status, goal.result) == (GoalStatus.ABORTED, GoalResult.GOAL_TOLERANCE_VIOLATED)
    assert goal.reason.startswith("wrist_1_joint had not arrived")
    assert original.now == pytest.approx(1.6, abs=0.0021)
    original.run(0.5)
    assert max_difference(positions(original)[1:], FREE[1:]) < 5e-3  # it went there anyway


def test_configured_tolerances_abort_goal() -> None:
    arm = ArmSettings(tolerances={"wrist_1_joint": JointTolerance(0.1, 1e-4)}, goal_time=0.2)
    floor = Floor(one_of_each(settings=CellSettings(arm=arm)))
    goal = run_goal(floor, GoalRequest("g", smooth(FREE, 1.0)))
    assert goal.result is GoalResult.GOAL_TOLERANCE_VIOLATED
    assert floor.now == pytest.approx(1.2, abs=0.0021)


def test_goal_is_preempted_by_other_command(original: Floor) -> None:
    for other in (
        lambda: original.arm.command(trajectory((INITIAL, 1.0))),
        lambda: original.arm.accept(GoalRequest("next", smooth(INITIAL, 1.0))),
        lambda: original.arm.cancel(),
    ):
        original.reset()
        ended: list[str] = []
        original.arm.on_goal_ended.append(lambda goal, into=ended: into.append(goal.goal_id))  # type: ignore[misc]
        try:
            goal = original.arm.accept(GoalRequest("first", smooth(MOVED, 2.0)))
            original.run(0.5)
            other()
            assert ended == ["first"]
            assert goal.status is GoalStatus.PREEMPTED
            original.run(2.5)
        finally:
            original.arm.on_goal_ended.pop()
        assert max_difference(positions(original), MOVED) > 0.05
    assert not original.arm.cancel()


def test_rejected_goal_leaves_active_goal(original: Floor) -> None:
    goal = original.arm.accept(GoalRequest("first", smooth(FREE, 1.0)))
    original.run(0.3)
    with pytest.raises(RejectedTrajectoryError):
        original.arm.accept(GoalRequest("bad", trajectory((MOVED, -1.0))))
    original.run(1.5)
    assert goal.status is GoalStatus.SUCCEEDED
