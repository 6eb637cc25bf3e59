import json
from math import nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.arm import ArmSettings, JointTolerance
from cellwright.mechanism.joint_trajectory import JointTrajectory, TrajectoryPoint
from cellwright.mechanism.trajectory_controller import JointTrajectoryController, RejectedTrajectoryError
from cellwright.mechanism.trajectory_goal import GoalRequest, GoalResult, GoalStatus, TrajectoryGoal
from cellwright.middleware.messages.control_msgs import JointTolerance as AskedTolerance
from tests.mechanism.trajectories import JOINTS, SECOND, START, STEP, controller, to

TARGET = (1.0, 2.0, -1.0, 1.0, 3.0, -1.0, 0.5)
REQUEST = GoalRequest("g", to(TARGET))
STILL = [0.0] * 7
ELBOW = JOINTS.index("elbow_joint")


def off(arm: JointTrajectoryController, time: int, error: float, joint: int = ELBOW) -> list[float]:
    """Return actual positions where one joint lags by `error`."""
    positions = arm.positions(time)
    positions[joint] -= error
    return positions


def update_goal(
    arm: JointTrajectoryController, time: int, error: float = 0.0, velocity_error: float = 0.0
) -> GoalStatus:
    velocities = arm.velocities(time)
    velocities[ELBOW] -= velocity_error
    arm.update(time, off(arm, time, error), velocities)
    assert arm.goal is not None
    return arm.goal.status


def test_goal_within_tolerances_succeeds_at_its_end() -> None:
    arm = controller()
    goal = arm.accept(REQUEST, 0)
    assert goal is arm.goal
    for time in range(0, SECOND, STEP):
        assert update_goal(arm, time, 0.099, 3.0) is GoalStatus.ACTIVE
    assert update_goal(arm, SECOND) is GoalStatus.SUCCEEDED
    assert (goal.result, goal.reason) == (GoalResult.SUCCESSFUL, "arrived")


def test_result_and_status_codes_are_those_of_messages() -> None:
    results = {"SUCCESSFUL": 0, "INVALID_GOAL": -1, "INVALID_JOINTS": -2, "OLD_HEADER_TIMESTAMP": -3}
    results |= {"PATH_TOLERANCE_VIOLATED": -4, "GOAL_TOLERANCE_VIOLATED": -5}
    assert {result.name: int(result) for result in GoalResult} == results
    statuses = {"ACTIVE": 1, "PREEMPTED": 2, "SUCCEEDED": 3, "ABORTED": 4}
    assert {status.name: int(status) for status in GoalStatus} == statuses


@pytest.mark.parametrize("error", [0.1001, -0.1001, nan])
def test_goal_off_path_aborts_and_trajectory_continues(error: float) -> None:
    arm = controller()
    goal = arm.accept(REQUEST, 0)
    assert update_goal(arm, SECOND // 2, error) is GoalStatus.ABORTED
    assert goal.result is GoalResult.PATH_TOLERANCE_VIOLATED
    assert goal.reason.startswith("elbow_joint left its path 0.500 s after the start: position is off by")
    assert arm.positions(SECOND) == list(TARGET)
    assert update_goal(arm, SECOND) is GoalStatus.ABORTED


def test_goal_succeeds_when_each_joint_arrived_once_in_goal_time() -> None:
    arm = controller()
    arm.accept(REQUEST, 0)
    assert update_goal(arm, SECOND, 0.11) is GoalStatus.ACTIVE
    # all the others have arrived by now: their later motion makes no difference
    time = SECOND + 600_000_000
    others = [value + 1.0 for value in arm.positions(time)]
    others[ELBOW] -= 1.0
    arm.update(time, others, STILL)
    assert arm.goal is not None
    assert arm.goal.status is GoalStatus.SUCCEEDED


@pytest.mark.parametrize(
    ("error", "velocity", "reason"),
    [(0.11, 0.0, "position is off by 0.11, 0.1 is allowed"), (0.0, 0.06, "velocity is off by 0.06, 0.05 is allowed")],
)
def test_goal_not_arrived_at_end_of_goal_time_aborts(error: float, velocity: float, reason: str) -> None:
    arm = controller()
    goal = arm.accept(REQUEST, 0)
    assert update_goal(arm, SECOND + 599_999_999, error, velocity) is GoalStatus.ACTIVE
    assert update_goal(arm, SECOND + 600_000_000, error, velocity) is GoalStatus.ABORTED
    assert goal.result is GoalResult.GOAL_TOLERANCE_VIOLATED
    assert goal.reason == f"elbow_joint had not arrived 0.600 s after the end: {reason}"


def test_goal_tolerances_override_settings() -> None:
    def accepted(
        path: float = 0.0, goal: float = 0.0, velocity: float = 0.0, time: int = 0
    ) -> JointTrajectoryController:
        arm = controller()
        tolerances = [AskedTolerance("elbow_joint", path), AskedTolerance("no_joint", -1.0)]
        arm.accept(GoalRequest("g", to(TARGET), tolerances, [AskedTolerance("elbow_joint", goal, velocity)], time), 0)
        return arm

    assert update_goal(accepted(path=0.01), 0, 0.02) is GoalStatus.ABORTED
    assert update_goal(accepted(path=1.0), 0, 0.9) is GoalStatus.ACTIVE
    assert update_goal(accepted(path=-1.0), 0, 99.0) is GoalStatus.ACTIVE
    assert update_goal(accepted(goal=0.01), SECOND, 0.02) is GoalStatus.ACTIVE
    assert update_goal(accepted(goal=1.0), SECOND, 0.9) is GoalStatus.SUCCEEDED
    assert update_goal(accepted(goal=-1.0), SECOND, 99.0) is GoalStatus.SUCCEEDED
    assert update_goal(accepted(velocity=1.0), SECOND, 0.0, 0.9) is GoalStatus.SUCCEEDED
    assert update_goal(accepted(velocity=-1.0), SECOND, 0.0, 99.0) is GoalStatus.SUCCEEDED
    assert update_goal(accepted(time=SECOND), 2 * SECOND - 1, 0.2) is GoalStatus.ACTIVE
    assert update_goal(accepted(time=SECOND), 2 * SECOND, 0.2) is GoalStatus.ABORTED
    assert update_goal(accepted(time=-1), 10_000 * SECOND, 0.2) is GoalStatus.ACTIVE


def test_tolerance_of_nan_is_refused() -> None:
    with pytest.raises(RejectedTrajectoryError, match="tolerance") as caught:
        controller().accept(GoalRequest("g", to(TARGET), [AskedTolerance("elbow_joint", nan)]), 0)
    assert caught.value.result is GoalResult.INVALID_GOAL


def test_configured_tolerances_and_goal_time_apply() -> None:
    settings = ArmSettings(tolerances={"elbow_joint": JointTolerance(0.0, 0.5)}, goal_time=0.0)
    arm = JointTrajectoryController(JOINTS, settings)
    arm.start(START, 0)
    arm.accept(REQUEST, 0)
    assert update_goal(arm, 0, 99.0) is GoalStatus.ACTIVE
    assert update_goal(arm, SECOND, 0.4) is GoalStatus.SUCCEEDED
    arm.accept(GoalRequest("late", to(START)), SECOND)
    assert update_goal(arm, 2 * SECOND, 0.6) is GoalStatus.ABORTED


@pytest.mark.parametrize("by", ["goal", "command", "cancel", "stop"])
def test_active_goal_is_preempted_by_other_command(by: str) -> None:
    arm = controller()
    goal = arm.accept(REQUEST, 0)
    now = SECOND // 2
    moving = arm.velocities(now)
    if by == "goal":
        assert arm.accept(GoalRequest("next", to(START)), now) is arm.goal
    elif by == "command":
        arm.command(to(START), now)
    elif by == "stop":
        arm.command(JointTrajectory((), ()), now)
    else:
        assert arm.cancel(now)
        assert not arm.cancel(now)
    assert goal.status is GoalStatus.PREEMPTED
    assert goal.result is None
    assert goal.reason
    if by in ("cancel", "stop"):
        assert arm.velocities(now) == moving
        assert arm.state(now + SECOND // 2).velocities == STILL
        assert arm.end == now + SECOND // 2


def test_goal_without_points_succeeds_when_joints_rest() -> None:
    arm = controller()
    arm.command(to(TARGET), 0)
    now = SECOND // 2
    arm.accept(GoalRequest("stop", JointTrajectory(JOINTS, ())), now)
    assert update_goal(arm, now + SECOND // 4, 99.0) is GoalStatus.ACTIVE
    assert update_goal(arm, now + SECOND // 2, 99.0) is GoalStatus.SUCCEEDED


def test_goal_is_not_checked_before_its_start() -> None:
    arm = controller()
    arm.accept(GoalRequest("g", to(TARGET, start=SECOND)), 0)
    assert update_goal(arm, SECOND - 1, 99.0) is GoalStatus.ACTIVE
    assert update_goal(arm, SECOND, 99.0) is GoalStatus.ABORTED


def test_partial_goal_is_checked_by_its_joints() -> None:
    arm = JointTrajectoryController(JOINTS, ArmSettings(allow_partial_joints_goal=True))
    arm.start(START, 0)
    wrist = JointTrajectory(["wrist_3_joint"], [TrajectoryPoint([1.0], time_from_start_ns=SECOND)])
    arm.accept(GoalRequest("g", wrist), 0)
    assert update_goal(arm, SECOND // 2, 99.0) is GoalStatus.ACTIVE
    assert update_goal(arm, SECOND, 99.0) is GoalStatus.SUCCEEDED


def test_start_discards_goal() -> None:
    arm = controller()
    arm.accept(REQUEST, 0)
    arm.start(START, 0)
    assert arm.goal is None
    arm.update(0, START, STILL)
    assert not arm.cancel(0)


@given(
    st.sampled_from([0, SECOND // 2, SECOND, SECOND + 500_000_000, 2 * SECOND]),
    st.floats(0.0, 0.2),
    st.floats(0.0, 0.1),
    st.sampled_from([-1, 0, SECOND]),
)
def test_restored_goal_continues_alike(time: int, error: float, velocity_error: float, goal_time: int) -> None:
    arm = controller()
    arm.accept(GoalRequest("g", to(TARGET), [AskedTolerance("elbow_joint", 0.15)], [], goal_time), 0)
    update_goal(arm, time, error, velocity_error)
    other = JointTrajectoryController(JOINTS)
    other.set_state(json.loads(json.dumps(arm.get_state())))
    assert isinstance(other.goal, TrajectoryGoal)
    assert update_goal(other, time + SECOND, error) is update_goal(arm, time + SECOND, error)
    assert other.get_state() == arm.get_state()
