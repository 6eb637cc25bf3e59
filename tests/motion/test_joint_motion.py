from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.client import ARM_JOINTS
from cellwright.mechanism.joint_trajectory import Knot, Trajectory, join_segment
from cellwright.motion import DEFAULT_LIMITS, JointMotion, move
from cellwright.motion.joints import STILL
from cellwright.util.errors import UsageError
from tests.motion.samples import ABOVE_BIN, ABOVE_TRAY, INITIAL, farthest

MOTION = move(INITIAL, ABOVE_BIN)


def test_motion_rests_at_start_and_end() -> None:
    assert MOTION.start == MOTION.at(0.0).positions == MOTION.at(-1.0).positions == INITIAL
    assert MOTION.end == MOTION.at(MOTION.duration).positions == MOTION.at(99.0).positions == ABOVE_BIN
    assert MOTION.at(99.0).velocities == MOTION.at(-1.0).velocities == STILL


@given(st.floats(0.0, MOTION.duration))
def test_motion_between_knots_equals_cubics_of_controller(time: float) -> None:
    knots = list(zip(MOTION.times, MOTION.positions, MOTION.velocities, strict=True))
    rows = [
        [
            join_segment(round(t0 * 1e9), Knot(p0[joint], v0[joint]), round(t1 * 1e9), Knot(p1[joint], v1[joint]))
            for (t0, p0, v0), (t1, p1, v1) in pairwise(knots)
        ]
        for joint in range(7)
    ]
    expected = Trajectory(rows).state(round(time * 1e9))
    point = MOTION.at(round(time * 1e9) / 1e9)
    assert point.positions == pytest.approx(expected.positions, abs=1e-8)
    assert point.velocities == pytest.approx(expected.velocities, abs=1e-5)


def test_points_are_evenly_spaced_and_end_with_motion() -> None:
    points = MOTION.points(0.1)
    assert [point.time for point in points[:3]] == pytest.approx([0.0, 0.1, 0.2])
    assert points[-1].positions == ABOVE_BIN
    assert points[-1].time == MOTION.duration
    assert 0.0 < points[-1].time - points[-2].time <= 0.1 + 1e-9
    assert len(JointMotion.hold(INITIAL, 1.0).points(0.25)) == 5
    with pytest.raises(UsageError, match="positive"):
        MOTION.points(0.0)


def test_then_joins_only_motions_that_fit() -> None:
    back = move(ABOVE_BIN, INITIAL)
    whole = MOTION.then(JointMotion.hold(ABOVE_BIN, 0.5)).then(back)
    assert whole.duration == pytest.approx(MOTION.duration + 0.5 + back.duration)
    assert farthest(whole.at(MOTION.duration + 0.25).positions, ABOVE_BIN) < 1e-12
    assert whole.at(MOTION.duration + 0.5 + 0.3).positions == pytest.approx(back.at(0.3).positions)
    assert MOTION.then(JointMotion.hold(ABOVE_BIN, 0.0)) == MOTION
    with pytest.raises(UsageError, match="position and velocity at which"):
        MOTION.then(MOTION)
    with pytest.raises(UsageError, match="position and velocity at which"):
        MOTION.then(move(ABOVE_BIN, INITIAL, start_velocity=STILL._replace(rail=0.1)))


def test_strain_is_used_share_of_limits() -> None:
    motion = move(ABOVE_BIN, ABOVE_TRAY)
    assert 0.9 < motion.strain(DEFAULT_LIMITS) < 1.1
    assert move(ABOVE_BIN, ABOVE_TRAY, DEFAULT_LIMITS.slower(2.0)).strain(DEFAULT_LIMITS) < 0.55
    assert JointMotion.hold(INITIAL, 1.0).strain(DEFAULT_LIMITS) == 0.0


def test_command_has_requested_order_without_first_knot() -> None:
    command = MOTION.command(ARM_JOINTS)
    assert command["joints"] == ARM_JOINTS
    assert command["times"] == list(MOTION.times[1:])
    assert command["waypoints"][-1] == ABOVE_BIN.ordered(ARM_JOINTS)
    assert command["velocities"][0] == MOTION.velocities[1].ordered(ARM_JOINTS)
    assert JointMotion.hold(INITIAL, 0.0).command()["times"] == [0.0]


@pytest.mark.parametrize("times", [(), (1.0, 2.0), (0.0, 0.0), (0.0, float("nan"))])
def test_times_that_do_not_rise_from_zero_are_refused(times: tuple[float, ...]) -> None:
    with pytest.raises(UsageError):
        JointMotion(times, (INITIAL,) * len(times), (STILL,) * len(times))


def test_lists_of_different_lengths_are_refused() -> None:
    with pytest.raises(UsageError, match="same length"):
        JointMotion((0.0, 1.0), (INITIAL, INITIAL), (STILL,))
