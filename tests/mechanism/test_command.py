from collections.abc import Sequence
from dataclasses import replace
from math import inf, nan

import pytest

from cellwright.mechanism import trajectory_controller as checks
from cellwright.mechanism.joint_trajectory import JointTrajectory, TrajectoryPoint
from cellwright.mechanism.trajectory_controller import (
    MAX_KEPT_SEGMENTS,
    MAX_POINTS,
    RejectedTrajectoryError,
    check_trajectory,
)
from cellwright.mechanism.trajectory_goal import GoalRequest, GoalResult
from cellwright.util.errors import RejectedCommandError
from tests.mechanism.trajectories import JOINTS, SECOND, START, controller, to

GOOD = to([1.0] * 7, [2.0] * 7)
POINT = TrajectoryPoint([1.0] * 7, time_from_start_ns=SECOND)


def with_names(*names: str) -> JointTrajectory:
    return replace(GOOD, joint_names=names)


def with_point(
    positions: Sequence[float] = POINT.positions, velocities: Sequence[float] = (), accelerations: Sequence[float] = ()
) -> JointTrajectory:
    return replace(GOOD, points=[TrajectoryPoint(positions, velocities, accelerations, SECOND)])


def with_times(*times: int) -> JointTrajectory:
    return replace(GOOD, points=[replace(POINT, time_from_start_ns=time) for time in times])


def one_bad(value: float) -> list[float]:
    return [1.0] * 3 + [value] + [1.0] * 3


NAMES = {
    "unknown name": (with_names(*JOINTS[:6], "wrist_4_joint"), "unknown joint 'wrist_4_joint'; did you mean"),
    "an eighth name": (with_names(*JOINTS, "vacuum_gripper_joint"), "unknown joint 'vacuum_gripper_joint'"),
    "missing name": (with_names(*JOINTS[1:]), "joints are missing: linear_arm_actuator_joint"),
    "no names": (with_names(), "joints are missing: linear_arm_actuator_joint, shoulder_pan_joint"),
    "name twice": (with_names(*JOINTS[:6], JOINTS[0]), "'linear_arm_actuator_joint' is named more than once"),
}
TOO_FAST = TrajectoryPoint([1e306] * 7, [0.0] * 7, [0.0] * 7, 1)
POINTS = {
    "few positions": (with_point([1.0] * 6), "point 0 has 6 positions for 7 joints"),
    "no positions": (with_point([], [1.0] * 7), "point 0 has 0 positions"),
    "few velocities": (with_point(velocities=[1.0] * 6), "6 velocities for 7 positions"),
    "many accelerations": (with_point(accelerations=[1.0] * 8), "8 accelerations for 7 positions"),
    "velocities for names only": (with_point([1.0] * 8, [1.0] * 7), "7 velocities for 8 positions"),
    "position nan": (with_point(one_bad(nan)), "position of elbow_joint must be finite (got nan)"),
    "velocity inf": (with_point(velocities=one_bad(inf)), "velocity of elbow_joint must be finite (got inf)"),
    "acceleration -inf": (
        with_point(accelerations=one_bad(-inf)),
        "acceleration of elbow_joint must be finite (got -inf)",
    ),
    "equal times": (with_times(SECOND, SECOND), "got 1 s for point 0 and 1 s for point 1"),
    "falling times": (with_times(SECOND, 3 * SECOND, 2 * SECOND), "got 3 s for point 1 and 2 s for point 2"),
    "too fast to compute": (replace(GOOD, points=[TOO_FAST]), "too large or too close to interpolate"),
}
PAST = {
    "all in the past": (replace(GOOD, start_ns=SECOND), "all 2 points lie in the past: the last one was due 7 s ago"),
    "due now": (with_times(0), "the last one is due now"),
}
REJECTED = [
    pytest.param(command, result, reason, id=name)
    for result, cases in (
        (GoalResult.INVALID_JOINTS, NAMES),
        (GoalResult.INVALID_GOAL, POINTS),
        (GoalResult.OLD_HEADER_TIMESTAMP, PAST),
    )
    for name, (command, reason) in cases.items()
]


@pytest.mark.parametrize(("command", "result", "reason"), REJECTED)
@pytest.mark.parametrize("interface", ["topic", "goal"])
def test_bad_command_is_refused_without_effect(
    command: JointTrajectory, result: GoalResult, reason: str, interface: str
) -> None:
    arm = controller()
    now = 10 * SECOND
    running = arm.accept(GoalRequest("running", to([2.0] * 7, every=100 * SECOND)), now)
    before = arm.get_state()
    with pytest.raises(RejectedTrajectoryError) as caught:  # noqa: PT012
        if interface == "topic":
            arm.command(command, now)
        else:
            arm.accept(GoalRequest("bad", command), now)
    assert caught.value.result is result
    assert reason in str(caught.value)
    assert isinstance(caught.value, RejectedCommandError)
    assert arm.get_state() == before
    assert running.active


def test_goal_without_points_must_name_joints() -> None:
    arm = controller()
    with pytest.raises(RejectedTrajectoryError, match="joints are missing"):
        arm.accept(GoalRequest("empty", JointTrajectory((), ())), 0)


def test_partial_trajectory_is_accepted_only_if_allowed() -> None:
    elbow = JointTrajectory(["elbow_joint"], [TrajectoryPoint([1.0], time_from_start_ns=SECOND)])
    assert check_trajectory(elbow, JOINTS, 0, allow_partial=True).joints == (3,)
    with pytest.raises(RejectedTrajectoryError, match="joints are missing"):
        check_trajectory(replace(elbow, joint_names=()), JOINTS, 0, allow_partial=True)


def test_checked_trajectory_drops_past_points_and_maps_joints() -> None:
    names = tuple(reversed(JOINTS))
    checked = check_trajectory(replace(GOOD, joint_names=names, start_ns=SECOND), JOINTS, 2 * SECOND)
    assert checked.joints == (6, 5, 4, 3, 2, 1, 0)
    assert checked.points == (GOOD.points[1],)
    assert (checked.start, checked.end) == (SECOND, 3 * SECOND)


def test_velocity_above_joint_limit_is_accepted() -> None:
    arm = controller()
    arm.command(to([6.0] * 7, every=1_000_000), 0)
    assert arm.velocities(0) == pytest.approx([(6.0 - a) * 1e3 for a in START])


@pytest.mark.slow
def test_trajectory_above_maximum_of_points_is_refused() -> None:
    arm = controller()
    arm.command(with_times(*range(SECOND, SECOND + MAX_POINTS)), 0)
    before = arm.get_state()
    with pytest.raises(RejectedTrajectoryError, match=rf"at most {MAX_POINTS} points \(got {MAX_POINTS + 1}\)"):
        arm.command(with_times(*range(SECOND, SECOND + MAX_POINTS + 1)), 0)
    assert arm.get_state() == before


@pytest.mark.slow
def test_delayed_commands_beyond_maximum_of_segments_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each command leaves one segment more to follow before it begins."""
    kept = MAX_POINTS + 100  # with all that are kept it takes as many seconds as now tenths of one
    assert kept < MAX_KEPT_SEGMENTS
    monkeypatch.setattr(checks, "MAX_KEPT_SEGMENTS", kept)
    busy = controller()
    busy.command(with_times(*range(SECOND, SECOND + MAX_POINTS)), 0)
    refused = 0
    for number in range(kept - MAX_POINTS + 5):
        try:
            busy.command(replace(with_times(SECOND), start_ns=2 * SECOND + number), 0)
        except RejectedTrajectoryError as error:
            assert "segments are queued before the trajectory starts" in str(error)  # noqa: PT017
            refused += 1
    assert 0 < refused < 10
    busy.command(with_times(SECOND), 0)  # a command that begins now replaces all
    assert busy.end == SECOND
