import json
from collections.abc import Sequence
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.arm import ArmSettings
from cellwright.mechanism.joint_trajectory import JointTrajectory, TrajectoryPoint
from cellwright.mechanism.trajectory_controller import JointTrajectoryController
from cellwright.util.errors import UsageError
from tests.mechanism.trajectories import JOINTS, SECOND, START, STEP, commands, controller, to

TARGET = (1.0, 2.0, -1.0, 1.0, 3.0, -1.0, 0.5)
OTHER = (-1.0, 2.5, -0.5, 0.5, 2.0, -2.0, 1.5)


def test_started_controller_holds_first_posture() -> None:
    arm = controller()
    assert arm.state(0) == (list(START), [0.0] * 7, [0.0] * 7)
    assert arm.end <= 0


def test_positions_are_joined_by_lines_from_desired_state() -> None:
    arm = controller()
    arm.command(to(TARGET, OTHER), SECOND)
    half = [(a + b) / 2 for a, b in zip(START, TARGET, strict=True)]
    assert arm.positions(SECOND) == list(START)
    assert arm.positions(SECOND + SECOND // 2) == pytest.approx(half)
    assert arm.velocities(SECOND) == pytest.approx([b - a for a, b in zip(START, TARGET, strict=True)])
    assert arm.positions(2 * SECOND) == list(TARGET)
    assert arm.end == 3 * SECOND
    assert arm.state(3 * SECOND) == (list(OTHER), [0.0] * 7, [0.0] * 7)


def test_velocities_make_cubics_and_accelerations_make_quintics() -> None:
    cubic, quintic = controller(), controller()
    velocities, accelerations = [0.1 * k for k in range(7)], [0.2 * k for k in range(7)]
    cubic.command(JointTrajectory(JOINTS, [TrajectoryPoint(TARGET, velocities, (), 2 * SECOND)]), 0)
    quintic.command(JointTrajectory(JOINTS, [TrajectoryPoint(TARGET, velocities, accelerations, 2 * SECOND)]), 0)
    for arm in (cubic, quintic):
        assert arm.velocities(0) == [0.0] * 7
        assert arm.velocities(2 * SECOND - 1) == pytest.approx(velocities, abs=1e-7)
    assert cubic.state(0).accelerations != [0.0] * 7
    assert quintic.state(0).accelerations == [0.0] * 7
    assert quintic.state(2 * SECOND - 1).accelerations == pytest.approx(accelerations, abs=1e-6)


def test_accelerations_without_velocities_are_ignored() -> None:
    plain, more = controller(), controller()
    plain.command(to(TARGET), 0)
    more.command(JointTrajectory(JOINTS, [TrajectoryPoint(TARGET, (), [1.0] * 7, SECOND)]), 0)
    assert more.state(SECOND // 3) == plain.state(SECOND // 3)


@given(commands(), st.permutations(range(7)), st.integers(0, 6 * SECOND))
def test_order_of_joint_names_makes_no_difference(command: JointTrajectory, order: list[int], time: int) -> None:
    def shuffled(row: Sequence[float]) -> list[float]:
        return [row[k] for k in order] if row else []

    names = [command.joint_names[k] for k in order]
    points = [
        TrajectoryPoint(shuffled(p.positions), shuffled(p.velocities), shuffled(p.accelerations), p.time_from_start_ns)
        for p in command.points
    ]
    one, other = controller(), controller()
    one.command(command, 0)
    other.command(JointTrajectory(names, points), 0)
    assert one.state(time) == other.state(time)


@pytest.mark.slow
@given(commands(), st.integers(0, 6 * SECOND), commands(), st.integers(-2 * SECOND, 2 * SECOND))
def test_new_command_takes_over_without_jump(
    first: JointTrajectory, now: int, second: JointTrajectory, delay: int
) -> None:
    arm, before = controller(), controller()
    for one in (arm, before):
        one.command(first, 0)
    second = replace(
        second, start_ns=now + delay, points=[*second.points, replace(second.points[-1], time_from_start_ns=9 * SECOND)]
    )
    arm.command(second, now)
    takes_over = max(now, now + delay)
    for time in range(now, takes_over, SECOND // 3):
        assert arm.state(time) == before.state(time)
    assert arm.positions(takes_over) == before.positions(takes_over)
    if second.points[0].velocities:
        assert arm.velocities(takes_over) == before.velocities(takes_over)
        if second.points[0].accelerations:
            assert arm.state(takes_over).accelerations == pytest.approx(before.state(takes_over).accelerations)
    for point in second.points:
        due = now + delay + point.time_from_start_ns
        if due > now:
            expected = dict(zip(second.joint_names, point.positions, strict=True))
            assert arm.positions(due) == [expected[name] for name in JOINTS]
    assert arm.end == now + delay + 9 * SECOND


@given(commands(), st.integers(0, 6 * SECOND), st.lists(st.floats(-7.0, 7.0), min_size=7, max_size=7))
def test_steering_is_the_command_of_one_point(before: JointTrajectory, now: int, target: list[float]) -> None:
    one, other = controller(), controller()
    for arm in (one, other):
        arm.command(before, 0)
    one.steer(target, SECOND // 20, now)
    other.command(JointTrajectory(JOINTS, [TrajectoryPoint(target, (), (), SECOND // 20)]), now)
    assert one.get_state() == other.get_state()


def test_repeated_command_starts_from_desired_position() -> None:
    arm = controller()
    arm.command(to(TARGET), 0)
    arm.command(to(TARGET), SECOND // 2)
    assert arm.positions(SECOND // 2) == pytest.approx([(a + b) / 2 for a, b in zip(START, TARGET, strict=True)])
    assert arm.velocities(SECOND) == pytest.approx([(b - a) / 2 for a, b in zip(START, TARGET, strict=True)])
    assert arm.end == SECOND + SECOND // 2


def test_past_points_are_dropped_and_others_reached_on_time() -> None:
    arm = controller()
    arm.command(to(TARGET, OTHER, TARGET, start=SECOND), 2 * SECOND + SECOND // 2)
    assert arm.positions(2 * SECOND + SECOND // 2) == list(START)
    assert arm.positions(3 * SECOND) == list(OTHER)
    assert arm.positions(4 * SECOND) == list(TARGET)
    assert arm.end == 4 * SECOND


def test_first_point_at_time_zero_is_ignored() -> None:
    arm = controller()
    points = [TrajectoryPoint(OTHER, time_from_start_ns=0), TrajectoryPoint(TARGET, time_from_start_ns=SECOND)]
    arm.command(JointTrajectory(JOINTS, points), 0)
    assert arm.positions(0) == list(START)
    assert arm.positions(SECOND) == list(TARGET)


def test_point_at_future_start_is_jump() -> None:
    arm = controller()
    arm.command(JointTrajectory(JOINTS, [TrajectoryPoint(TARGET, time_from_start_ns=0)], SECOND), 0)
    assert arm.positions(SECOND - 1) == list(START)
    assert arm.positions(SECOND) == list(TARGET)


def test_positions_beyond_names_are_ignored() -> None:
    plain, more = controller(), controller()
    plain.command(to(TARGET), 0)
    more.command(to((*TARGET, float("nan"))), 0)
    assert more.state(SECOND // 3) == plain.state(SECOND // 3)


@given(commands(), st.integers(0, 6 * SECOND))
def test_command_without_points_stops_joints_from_desired_state(command: JointTrajectory, now: int) -> None:
    arm = controller()
    arm.command(command, 0)
    before = arm.state(now)
    arm.command(JointTrajectory((), ()), now)
    assert arm.positions(now) == before.positions
    assert arm.velocities(now) == before.velocities
    assert arm.end == (now + SECOND // 2 if any(before.velocities) else now)
    travel = [p + 0.625 * 0.5 * v for p, v in zip(before.positions, before.velocities, strict=True)]
    assert arm.positions(now + SECOND) == pytest.approx(travel)
    assert arm.state(now + SECOND)[1:] == ([0.0] * 7, [0.0] * 7)


def test_partial_command_leaves_other_joints_moving() -> None:
    arm = JointTrajectoryController(JOINTS, ArmSettings(allow_partial_joints_goal=True))
    arm.start(START, 0)
    whole = JointTrajectoryController(JOINTS)
    whole.start(START, 0)
    for one in (arm, whole):
        one.command(to(TARGET, OTHER), 0)
    arm.command(JointTrajectory(["elbow_joint"], [TrajectoryPoint([2.0], time_from_start_ns=SECOND)]), SECOND // 2)
    for time in range(SECOND // 2, 3 * SECOND, SECOND // 10):
        others = [k for k in range(7) if JOINTS[k] != "elbow_joint"]
        assert [arm.positions(time)[k] for k in others] == [whole.positions(time)[k] for k in others]
    elbow = JOINTS.index("elbow_joint")
    assert arm.positions(SECOND // 2)[elbow] == whole.positions(SECOND // 2)[elbow]
    assert arm.positions(SECOND + SECOND // 2)[elbow] == 2.0
    assert arm.end == 2 * SECOND
    at_rest = 3 * SECOND
    arm.command(JointTrajectory(["elbow_joint"], [TrajectoryPoint([1.0], time_from_start_ns=SECOND)]), at_rest)
    assert arm.positions(at_rest + SECOND) == [1.0 if k == elbow else OTHER[k] for k in range(7)]


def test_query_state_before_stored_motion_is_refused() -> None:
    arm = controller()
    arm.command(to(TARGET, OTHER), SECOND)
    assert arm.query_state(0).positions == list(START)
    assert arm.query_state(2 * SECOND).positions == list(TARGET)
    assert arm.query_state(99 * SECOND).positions == list(OTHER)
    arm.command(JointTrajectory((), ()), 2 * SECOND)
    with pytest.raises(UsageError, match=r"must not be before .* \(got 1\.000 s before it\)"):
        arm.query_state(SECOND)


def test_following_has_desired_actual_and_error() -> None:
    arm = controller()
    actual = [value - 0.01 for value in START]
    following = arm.following(0, actual, [0.5] * 7)
    assert following.desired == arm.state(0)
    assert following.actual == (actual, [0.5] * 7)
    assert following.error[0] == pytest.approx([0.01] * 7)
    assert following.error[1] == [-0.5] * 7


@pytest.mark.slow
@given(st.lists(st.tuples(commands(), st.integers(0, 3 * SECOND), st.integers(0, SECOND)), max_size=4))
def test_restored_controller_continues_bit_for_bit(story: list[tuple[JointTrajectory, int, int]]) -> None:
    arm, now = controller(), 0
    for command, pause, delay in story:
        now += pause
        arm.command(replace(command, start_ns=now + delay), now)
    other = JointTrajectoryController(JOINTS)
    other.set_state(json.loads(json.dumps(arm.get_state())))
    assert other.get_state() == arm.get_state()
    for one in (arm, other):
        one.command(to(TARGET, start=now + SECOND), now + STEP)
    for time in range(now, now + 3 * SECOND, SECOND // 7):
        assert other.state(time) == arm.state(time)
    assert other.end == arm.end


def test_query_changes_no_state() -> None:
    queried, left_alone = controller(), controller()
    for arm in (queried, left_alone):
        arm.command(to(TARGET, OTHER), 0)
    for time in (SECOND, 5 * SECOND, 0, SECOND // 2):
        queried.state(time)
    assert queried.get_state() == left_alone.get_state()
