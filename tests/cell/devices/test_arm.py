"""Arm on its servos, in the running cell."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from cellwright.cell.model.parts import PART_TYPES
from cellwright.config.arm import ARM_JOINTS, ArmSettings, JointGains
from cellwright.config.trial.trial import CellSettings
from cellwright.engine.clock import nanoseconds
from cellwright.engine.snapshot import restore_snapshot, take_snapshot
from cellwright.mechanism.joint_trajectory import JointTrajectory, TrajectoryPoint
from cellwright.mechanism.trajectory_controller import RejectedTrajectoryError
from cellwright.mechanism.trajectory_goal import GoalRequest
from cellwright.util.pose import Pose
from tests.cell.devices.floor import MM, Floor, named, one_of_each

INITIAL = (0.0, 3.14, -1.13, 1.51, 3.77, -1.51, 0.0)
FREE = (0.0, 3.2, -1.2, 2.5, 3.5, -1.51, 0.0)
MOVED = (0.4, 2.6, -1.4, 2.2, 3.9, -1.2, 0.5)
# rail, pan, lift, elbow, wrists 1 to 3 of the lesson, and the sag of the cup there under gravity [m]: a calculation
# of the original's gains against its masses
PICK = (2.05, 3.2, -0.47, 2.09, 3.1, -1.51, 0.0)  # on the rail where no bin supports the cup
ON_BELT = (1.84, 0.0, -0.66, 1.65, 3.7, -1.57, 0.0)
ON_TRAY = (2.0, 1.5, -0.27, 1.02, 4.0, -1.51, 0.0)
SAGS = [(PICK, -1.24), (ON_BELT, -2.06), (ON_TRAY, -2.98), ((0.0,) * 7, -3.25)]


@pytest.fixture(scope="module")
def precise_cell() -> Floor:
    return Floor(one_of_each(), "precise")


@pytest.fixture
def precise(precise_cell: Floor) -> Floor:
    return precise_cell.reset()


def positions(floor: Floor) -> list[float]:
    return floor.arm.read().positions


def is_driven(floor: Floor) -> bool:
    """Return whether the setpoints of the servos are written in each step."""
    return floor.arm.stepping


def max_difference(a: Sequence[float], b: Sequence[float]) -> float:
    return float(np.abs(np.subtract(a, b)).max())


def trajectory(*points: tuple[Sequence[float], float], names: Sequence[str] = ARM_JOINTS) -> JointTrajectory:
    return JointTrajectory(
        names, [TrajectoryPoint(place, time_from_start_ns=nanoseconds(time)) for place, time in points]
    )


def smooth(place: Sequence[float], seconds: float) -> JointTrajectory:
    still = [0.0] * 7
    return JointTrajectory(ARM_JOINTS, [TrajectoryPoint(place, still, still, nanoseconds(seconds))])


def test_precise_servo_holds_initial_posture_from_first_step(precise: Floor) -> None:
    for _ in range(500):
        precise.cell.step()
        assert max_difference(positions(precise), INITIAL) < 1e-6


def test_original_servo_yields_to_gravity_only(original: Floor) -> None:
    """Except for integral terms a servo of gain p yields by torque / p; nothing else moves."""
    data, model = original.simulation.data, original.model
    gravity = [float(data.qfrc_bias[model.joint(name).dofadr[0]]) for name in ARM_JOINTS]
    gains = (10000, 10000, 50000, 50000, 100, 75, 25)
    expected = [-force / gain for force, gain in zip(gravity, gains, strict=True)]
    worst = 0.0
    for _ in range(500):
        original.cell.step()
        worst = max(worst, max_difference(positions(original), INITIAL))
    assert np.subtract(positions(original), INITIAL) == pytest.approx(expected, abs=5e-5)
    assert worst < 1.2 * max(map(abs, expected)) < 3e-3


def test_configured_initial_posture_is_held() -> None:
    floor = Floor(one_of_each(initial_joint_states={"elbow_joint": 2.0, "linear_arm_actuator_joint": -1.0}), "precise")
    expected = (-1.0, 3.14, -1.13, 2.0, 3.77, -1.51, 0.0)
    floor.run(1.0)
    assert positions(floor) == pytest.approx(expected, abs=1e-6)
    assert floor.arm.controller.positions(floor.simulation.now) == pytest.approx(expected)


@pytest.mark.parametrize(("posture", "sag"), SAGS)
def test_original_servo_lets_cup_sag_as_in_original(original: Floor, posture: Sequence[float], sag: float) -> None:
    original.put_arm(posture)
    height = original.cup().position[2]
    original.run(2.0)
    assert original.cup().position[2] - height == pytest.approx(sag * MM, abs=0.3 * MM)


@pytest.mark.parametrize(("posture", "sag"), SAGS)
def test_precise_servo_does_not_sag(precise: Floor, posture: Sequence[float], sag: float) -> None:
    precise.put_arm(posture)
    height = precise.cup().position[2]
    precise.run(1.0)
    assert precise.cup().position[2] == pytest.approx(height, abs=0.01 * MM)


def test_configured_gain_reduces_sag() -> None:
    """Ten times the wrist's gain leaves a tenth of its sag."""
    sags = []
    for gains in ({}, {"wrist_1_joint": JointGains(1000, 20)}):
        trial = one_of_each(settings=CellSettings(arm=ArmSettings(gains=gains)))
        floor = Floor(trial)
        floor.run(1.0)
        sags.append(positions(floor)[4] - INITIAL[4])
    assert sags[0] / sags[1] == pytest.approx(10.0, rel=0.02)


def test_idle_arm_stops_driving_and_holds_posture(precise: Floor) -> None:
    precise.run(0.1)
    assert not is_driven(precise)
    precise.send(FREE)
    precise.cell.step()
    assert is_driven(precise)
    precise.run(1.1)
    assert not is_driven(precise)
    precise.run(1.0)
    assert max_difference(positions(precise), FREE) < 1e-4


def test_precise_servo_tracks_within_milliradian(precise: Floor) -> None:
    """Every joint at once, 2 rad/s^2 at the peak of the quintic (5.77 distance / time^2)."""
    goal = [start + way for start, way in zip(INITIAL, (0.8, 1.0, -0.5, 0.8, -1.0, 1.0, -1.0), strict=True)]
    precise.arm.command(smooth(goal, math.sqrt(5.77 / 2.0)))
    worst, fastest = 0.0, 0.0
    for _ in range(1000):
        precise.cell.step()
        worst = max(worst, *map(abs, precise.arm.following().error[0]))
        fastest = max(fastest, *map(abs, precise.arm.following().desired.accelerations))
    assert fastest == pytest.approx(2.0, rel=0.01)
    assert worst < 0.3e-3  # 0.11; a setpoint that is a step late or early costs 2
    assert max_difference(positions(precise), goal) < 1e-4


def test_precise_servo_tracks_with_part_in_cup(precise: Floor) -> None:
    precise.grasp("part1")
    goal = [now + way for now, way in zip(positions(precise), (0.5, 0.8, -0.6, 0.5, 0.0, 0.3, 0.5), strict=True)]
    precise.arm.command(smooth(goal, 1.6))
    worst = 0.0
    for _ in range(900):
        precise.cell.step()
        worst = max(worst, *map(abs, precise.arm.following().error[0]))
    assert worst < 1e-3


def test_trajectory_of_positions_moves_in_straight_lines(precise: Floor) -> None:
    precise.run(0.3)
    precise.arm.command(trajectory((FREE, 1.0), (MOVED, 3.0)))
    at = {}
    for _ in range(1600):
        precise.cell.step()
        at[round(precise.now, 3)] = positions(precise)
    midpoints = np.add(INITIAL, FREE) / 2, np.add(FREE, MOVED) / 2
    assert at[0.8] == pytest.approx(midpoints[0], abs=1.5e-3)
    assert at[2.3] == pytest.approx(midpoints[1], abs=1.5e-3)
    assert at[3.5] == pytest.approx(MOVED, abs=1e-4)
    speed = (np.array(at[2.4]) - at[2.2]) / 0.2
    assert speed == pytest.approx(np.subtract(MOVED, FREE) / 2.0, abs=1e-3)


def test_trajectory_with_velocities_moves_on_cubics(precise: Floor) -> None:
    still = [0.0] * 7
    precise.arm.command(JointTrajectory(ARM_JOINTS, [TrajectoryPoint(FREE, still, (), 2_000_000_000)]))
    precise.run(0.5)
    quarter = np.add(INITIAL, np.subtract(FREE, INITIAL) * (3 / 16 - 2 / 64))
    assert positions(precise) == pytest.approx(quarter, abs=5e-4)
    precise.run(0.5)
    assert precise.arm.read().velocities == pytest.approx(np.subtract(FREE, INITIAL) * 0.75, abs=2e-3)


def test_new_command_starts_from_present_position(precise: Floor) -> None:
    precise.arm.command(smooth(MOVED, 2.0))
    precise.run(1.0)
    before = positions(precise)
    precise.arm.command(trajectory((INITIAL, 1.0)))
    precise.cell.step()
    assert max_difference(positions(precise), before) < 0.01
    precise.run(1.2)
    assert max_difference(positions(precise), INITIAL) < 1e-3


def test_command_with_future_stamp_starts_later(precise: Floor) -> None:
    later = replace(trajectory((FREE, 1.0)), start_ns=1_000_000_000)
    precise.arm.command(later)
    precise.run(0.99)
    assert max_difference(positions(precise), INITIAL) < 1e-5
    precise.run(1.2)
    assert max_difference(positions(precise), FREE) < 1e-3


def test_empty_command_stops_arm_in_half_second(precise: Floor) -> None:
    precise.arm.command(trajectory((MOVED, 1.0)))
    precise.run(0.5)
    precise.arm.command(JointTrajectory(ARM_JOINTS, []))
    precise.run(0.52)
    there = positions(precise)
    assert max(map(abs, precise.arm.read().velocities)) < 1e-2
    precise.run(1.0)
    assert max_difference(positions(precise), there) < 1e-3
    assert max_difference(there, MOVED) > 0.05


def test_rejected_command_changes_no_state(precise: Floor) -> None:
    hashes = []
    bad = [
        JointTrajectory(ARM_JOINTS[:6], [TrajectoryPoint(MOVED[:6], time_from_start_ns=10**9)]),
        JointTrajectory((*ARM_JOINTS[:6], "wrist_4_joint"), [TrajectoryPoint(MOVED, time_from_start_ns=10**9)]),
        JointTrajectory((*ARM_JOINTS, "vacuum_gripper_joint"), [TrajectoryPoint((*MOVED, 0.0), (), (), 10**9)]),
        trajectory((MOVED[:6], 1.0)),
        trajectory((MOVED, 1.0), (FREE, 1.0)),
        trajectory((MOVED, -1.0)),
        trajectory(((math.nan, *MOVED[1:]), 1.0)),
    ]
    for commands in ([], bad):
        precise.reset()
        precise.arm.command(smooth(FREE, 1.0))
        precise.run(0.4)
        for command in commands:
            with pytest.raises(RejectedTrajectoryError):
                precise.arm.command(command)
        precise.run(1.0)
        hashes.append(precise.cell.state_hash())
    assert hashes[0] == hashes[1]
    assert max_difference(positions(precise), FREE) < 1e-4


def test_extra_position_beyond_names_is_ignored(precise: Floor) -> None:
    precise.arm.command(trajectory(((*FREE, 9.0), 1.0)))
    precise.run(1.3)
    assert max_difference(positions(precise), FREE) < 1e-3


def test_joint_names_in_other_order_are_followed(precise: Floor) -> None:
    precise.arm.command(trajectory((FREE[::-1], 1.0), names=ARM_JOINTS[::-1]))
    precise.run(1.3)
    assert max_difference(positions(precise), FREE) < 1e-3


def test_partial_command_is_followed_only_if_allowed(precise: Floor) -> None:
    only_rail = trajectory(((0.5,), 1.0), names=ARM_JOINTS[:1])
    with pytest.raises(RejectedTrajectoryError, match="joints are missing"):
        precise.arm.command(only_rail)
    settings = CellSettings(arm=ArmSettings(servo="precise", allow_partial_joints_goal=True))
    floor = Floor(one_of_each(settings=settings))
    floor.arm.command(only_rail)
    floor.run(1.3)
    assert max_difference(positions(floor), (0.5, *INITIAL[1:])) < 1e-3


def test_effort_stays_within_limit(original: Floor) -> None:
    original.arm.command(trajectory(((2.0, *INITIAL[1:]), 0.1)))
    max_effort = 0.0
    for _ in range(200):
        original.cell.step()
        max_effort = max(max_effort, abs(original.arm.read().efforts[0]))
    assert max_effort == 1000.0


def test_arm_blocked_by_bin_stops_and_returns(original: Floor) -> None:
    """On a command far below the floor of a bin the cup stays on it, and the arm returns unharmed."""
    original.put_arm((0.25, *PICK[1:]))
    start = original.cup().position
    deep = original.reach(Pose((start[0], start[1], 0.68), original.cup().quaternion))
    original.send(deep)
    original.run(2.0)
    assert 0.725 < original.cup().position[2] < 0.76
    original.send(FREE)
    original.run(2.0)
    assert max_difference(positions(original)[1:], FREE[1:]) < 5e-3


@pytest.mark.parametrize("interface", ["command", "goal"])
def test_snapshot_of_moving_arm_resumes_bit_for_bit(original: Floor, interface: str) -> None:
    if interface == "goal":
        original.arm.accept(GoalRequest("g", smooth(FREE, 1.0)))
    else:
        original.arm.command(trajectory((FREE, 0.6), (MOVED, 1.2)))
    original.run(0.4)
    snapshot = take_snapshot(original.simulation)
    hashes = []
    for _ in range(2):
        original.run(2.0)
        hashes.append(original.cell.state_hash())
        restore_snapshot(original.simulation, snapshot)
    assert hashes[0] == hashes[1]


@pytest.mark.parametrize("seconds", [1.0, 6.0])
def test_reset_arm_has_state_of_new_cell(original: Floor, seconds: float) -> None:
    """The arm was moving when the last run ended, or at rest."""
    original.arm.accept(GoalRequest("g", smooth(MOVED, 5.0)))
    original.run(seconds)
    original.reset()
    assert original.cell.state_hash() == Floor(one_of_each(), "original").cell.state_hash()
    original.run(1.0)
    assert max_difference(positions(original), INITIAL) < 3e-3


def test_moving_arm_wakes_no_distant_part(original: Floor) -> None:
    original.run(1.0)
    original.send(FREE, MOVED)
    original.run(1.0)
    assert all(original.asleep(original.part(named(kind)).body) for kind in PART_TYPES)
