from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.motion import DEFAULT_LIMITS, JointMotion, Joints, along, move, straight, through, timed, tool_down
from cellwright.motion.joints import STILL
from cellwright.motion.trajectories import _profile
from cellwright.util.errors import UnreachableError, UsageError
from tests.motion.samples import ABOVE_BELT, ABOVE_BIN, ABOVE_TRAY, INITIAL, farthest, moderate

SLACK = 1.08
"""Maximum share of the allowed acceleration that cubics between knots use where the jerk changes."""


@settings(max_examples=40)
@given(moderate, moderate)
def test_move_keeps_limits_and_is_shortest(a: Joints, b: Joints) -> None:
    motion = move(a, b)
    assert motion.start == a
    assert farthest(motion.end, b) < 1e-8
    assert motion.strain(DEFAULT_LIMITS) < SLACK
    if farthest(a, b) > 1e-3:
        # one quantity is always at its limit, so that 2 % faster exceeds one: the duration is the ideal one
        slowest = max(
            _profile(a, a._replace(**{name: getattr(b, name)}), STILL, STILL, DEFAULT_LIMITS, 0.0).duration
            for name in Joints._fields
        )
        assert motion.duration == pytest.approx(slowest, abs=1e-6)


@settings(max_examples=40)
@given(moderate, moderate, st.floats(0.0, 1.0))
def test_move_from_rest_to_rest_never_turns_back(a: Joints, b: Joints, share: float) -> None:
    motion = move(a, b)
    earlier = motion.at(share * motion.duration).positions
    later = motion.at((share + 0.02) * motion.duration).positions
    for p, q, x, y in zip(earlier, later, a, b, strict=True):
        assert (q - p) * (y - x) >= -1e-6


def test_move_is_straight_if_one_joint_is_slowest() -> None:
    goal = Joints(*(a + 0.2 * v for a, v in zip(INITIAL, DEFAULT_LIMITS.velocity, strict=True)))
    goal = goal._replace(wrist_1=INITIAL.wrist_1 + 2.0)
    motion = move(INITIAL, goal)
    for point in motion.points(0.05):
        shares = [(p - a) / (b - a) for p, a, b in zip(point.positions, INITIAL, goal, strict=True)]
        assert shares == pytest.approx([shares[0]] * 7, abs=1e-6)


@settings(max_examples=30)
@given(moderate, moderate)
def test_move_knots_reproduce_profile(a: Joints, b: Joints) -> None:
    profile = _profile(a, b, STILL, STILL, DEFAULT_LIMITS, 0.0)
    motion = move(a, b)
    for index in range(200):
        time = profile.duration * index / 199
        assert farthest(Joints(*profile.at_time(time)[0]), motion.at(time).positions) < 1e-3


def test_same_request_gives_same_bits() -> None:
    assert move(INITIAL, ABOVE_TRAY) == move(INITIAL, ABOVE_TRAY)
    assert through([INITIAL, ABOVE_BIN, ABOVE_TRAY]) == through([INITIAL, ABOVE_BIN, ABOVE_TRAY])


def test_move_honours_min_duration_and_zero_distance() -> None:
    assert move(INITIAL, ABOVE_BIN, min_duration=4.0).duration == pytest.approx(4.0)
    assert move(INITIAL, INITIAL).duration == 0.0
    assert move(INITIAL, INITIAL).end == INITIAL


def test_move_honours_velocities_at_both_ends() -> None:
    fast = STILL._replace(shoulder_pan=0.5)
    motion = move(INITIAL, ABOVE_BIN, start_velocity=fast, goal_velocity=fast)
    assert motion.at(0.0).velocities == motion.at(motion.duration).velocities == fast
    with pytest.raises(UsageError, match="within the limit"):
        move(INITIAL, ABOVE_BIN, start_velocity=STILL._replace(elbow=9.0))
    with pytest.raises(UsageError, match="within the limit"):
        move(INITIAL, ABOVE_BIN, goal_velocity=STILL._replace(elbow=float("nan")))


def test_move_beyond_joint_limit_is_refused() -> None:
    with pytest.raises(UnreachableError, match=r"rail would go to 2\.2"):
        move(INITIAL, INITIAL._replace(rail=2.2))
    with pytest.raises(UnreachableError, match="rail"):
        move(INITIAL._replace(rail=2.05), INITIAL, start_velocity=STILL._replace(rail=1.2))
    # from beyond its end a joint may come back
    assert move(INITIAL._replace(rail=2.11), INITIAL).end == INITIAL


VIAS = st.lists(moderate, min_size=3, max_size=5)


@pytest.mark.slow
@settings(max_examples=25)
@given(VIAS)
def test_through_stays_between_waypoints(stops: list[Joints]) -> None:
    motion = through(stops)
    assert motion.start == stops[0]
    assert farthest(motion.end, stops[-1]) < 1e-8
    assert motion.strain(DEFAULT_LIMITS) < SLACK
    assert motion.duration <= sum(move(a, b).duration for a, b in pairwise(stops)) + 1e-6
    marks = passed(motion, stops)
    for (t0, a), (t1, b) in pairwise(zip(marks, stops, strict=True)):
        for step in range(11):
            point = motion.at(t0 + (t1 - t0) * step / 10).positions
            for p, x, y in zip(point, a, b, strict=True):
                assert min(x, y) - 1e-3 <= p <= max(x, y) + 1e-3


def test_through_passes_waypoint_on_the_way_without_stop() -> None:
    middle = Joints(*((a + b) / 2 for a, b in zip(ABOVE_BIN, ABOVE_TRAY, strict=True)))
    motion = through([ABOVE_BIN, middle, ABOVE_TRAY])
    stopping = 2 * move(ABOVE_BIN, middle).duration
    straight_on = move(ABOVE_BIN, ABOVE_TRAY).duration
    assert motion.duration < stopping - 0.7 * (stopping - straight_on)


def test_through_merges_repeated_waypoints_and_refuses_none() -> None:
    assert through([INITIAL, INITIAL, ABOVE_BIN, ABOVE_BIN]) == move(INITIAL, ABOVE_BIN)
    assert through([INITIAL]).duration == 0.0
    with pytest.raises(UsageError, match="must not be empty"):
        through([])


@pytest.mark.parametrize("drop", [0.02, 0.1, 0.25])
def test_along_follows_tool_path_within_limits(drop: float) -> None:
    path = straight(ABOVE_BIN, tool_down(-0.3, 0.23, 1.0 - drop))
    motion = along(path)
    assert motion.start == path[0]
    assert motion.end == path[-1]
    assert motion.strain(DEFAULT_LIMITS) < SLACK
    assert motion.duration < 3.0 * move(path[0], path[-1]).duration
    for joints in path:
        assert min(farthest(joints, point.positions) for point in motion.points(0.002)) < 0.02


def test_along_single_position_holds_and_none_is_refused() -> None:
    assert along([INITIAL, INITIAL]) == JointMotion.hold(INITIAL, 0.0)
    with pytest.raises(UsageError, match="must not be empty"):
        along([])


def test_timed_passes_positions_at_given_times() -> None:
    motion = timed((0.0, 1.0, 2.5), (INITIAL, ABOVE_BIN, ABOVE_BELT))
    assert motion.at(1.0).positions == ABOVE_BIN
    assert motion.velocities[0] == motion.velocities[-1] == STILL
    with pytest.raises(UsageError, match="rise"):
        timed((0.0, 1.0, 1.0), (INITIAL, ABOVE_BIN, ABOVE_BELT))
    with pytest.raises(UsageError, match="at least 2"):
        timed((0.0,), (INITIAL,))


def passed(motion: JointMotion, stops: list[Joints]) -> list[float]:
    """Return the times at which the motion is at each of its waypoints, which are knots of it [s]."""
    marks, index = [], 0
    for stop in stops:
        while farthest(motion.positions[index], stop) > 1e-8:
            index += 1
        marks.append(motion.times[index])
    return marks
