import json
import sys
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.mechanism.joint_trajectory import Knot, Segment, Trajectory, join_segment, rest_segment, stop_segment
from tests.mechanism.trajectories import SECOND, numbers

starts = st.integers(0, 1000 * SECOND)
durations = st.integers(SECOND // 1000, 20 * SECOND)
knots = st.one_of([st.tuples(*[numbers] * specified).map(lambda values: Knot(*values)) for specified in (1, 2, 3)])


def reference(segment: Segment, time: int) -> tuple[float, float, float]:
    """Return position, velocity and acceleration on a segment, by numpy's polynomials."""
    polynomial = np.polynomial.Polynomial(segment.coefficients)
    t = (time - segment.start) / SECOND
    return float(polynomial(t)), float(polynomial.deriv()(t)), float(polynomial.deriv(2)(t))


def scale(a: Knot, b: Knot, seconds: float) -> float:
    """Return the magnitude of intermediate results, as a scale for rounding errors."""
    return 20 * (1 + sum(abs(x or 0.0) * max(1.0, seconds) ** k for knot in (a, b) for k, x in enumerate(knot)))


@given(starts, durations, knots, knots)
def test_segment_meets_both_knots(start: int, duration: int, a: Knot, b: Knot) -> None:
    segment = join_segment(start, a, start + duration, b)
    specified = sum(x is not None and y is not None for x, y in zip(a, b, strict=True))
    t = duration / SECOND
    for time, knot in ((start, a), (start + duration, b)):
        for order, (got, expected) in enumerate(zip(reference(segment, time), knot[:specified], strict=False)):
            assert expected is not None
            assert got * t**order == pytest.approx(expected * t**order, abs=1e-12 * scale(a, b, t))
    assert segment.final == b.position


@given(starts, durations, knots, knots, st.floats(0.0, 1.0, exclude_max=True))
def test_sampling_equals_slow_reference(start: int, duration: int, a: Knot, b: Knot, share: float) -> None:
    time = start + int(share * duration)
    segment = join_segment(start, a, start + duration, b)
    got = Trajectory([[segment]]).state(time)
    expected = reference(segment, time)
    t = duration / SECOND
    for order, (one, other) in enumerate(zip(got, expected, strict=True)):
        assert one[0] * t**order == pytest.approx(other * t**order, abs=1e-12 * scale(a, b, t))


@given(
    st.lists(st.tuples(durations, numbers, numbers, numbers), min_size=2, max_size=6),
    st.sampled_from([1, 2, 3]),
    st.lists(st.integers(-SECOND, 121 * SECOND), max_size=30),
)
def test_points_are_reached_exactly_without_jumps(
    points: list[tuple[int, float, float, float]], specified: int, samples: list[int]
) -> None:
    times = list(np.cumsum([duration for duration, *_ in points]).tolist())
    at = [Knot(*values[:specified]) for _, *values in points]
    segments = [join_segment(s, a, e, b) for (s, e), (a, b) in zip(pairwise(times), pairwise(at), strict=True)]
    trajectory = Trajectory([segments])
    for time, knot in zip(times, at, strict=True):
        assert trajectory.positions(time) == [knot.position]
        before = trajectory.state(time - 1)
        if time > times[0]:
            assert before.positions == pytest.approx([knot.position], abs=1e-4)
            if specified > 1:
                # within the last nanosecond of a millisecond some 10 * 12 rad / (1 ms)^2 may still come
                assert before.velocities == pytest.approx([knot.velocity], abs=0.5)
    # earlier samples make no difference
    for time in samples:
        assert trajectory.state(time) == Trajectory([segments]).state(time)


@given(starts, durations, st.lists(st.tuples(numbers, numbers), min_size=3, max_size=3))
def test_velocity_is_continuous_between_cubics(start: int, duration: int, at: list[tuple[float, float]]) -> None:
    a, b, c = (Knot(*values) for values in at)
    first, second = (
        join_segment(start, a, start + duration, b),
        join_segment(start + duration, b, start + 2 * duration, c),
    )
    _, left, _ = reference(first, start + duration)
    _, right, _ = reference(second, start + duration)
    assert left == pytest.approx(right, abs=1e-9 * (1 + SECOND / duration))


def test_joints_rest_before_first_and_after_last_segment() -> None:
    trajectory = Trajectory([[join_segment(SECOND, Knot(1.0, 2.0), 2 * SECOND, Knot(3.0, 4.0))]])
    assert trajectory.state(0) == ([1.0], [0.0], [0.0])
    assert trajectory.state(2 * SECOND - 1).velocities == pytest.approx([4.0])
    assert trajectory.state(2 * SECOND) == ([3.0], [0.0], [0.0])
    assert (trajectory.start, trajectory.end) == (SECOND, 2 * SECOND)


def test_joint_rests_in_gap_and_later_segment_cuts_earlier() -> None:
    line = join_segment(0, Knot(0.0), 4 * SECOND, Knot(4.0))
    gap = Trajectory([[line, join_segment(6 * SECOND, Knot(4.0), 7 * SECOND, Knot(5.0))]])
    assert gap.state(5 * SECOND) == ([4.0], [0.0], [0.0])
    assert gap.state(6 * SECOND + SECOND // 2) == ([4.5], [1.0], [0.0])
    cut = Trajectory([[line, join_segment(SECOND, Knot(1.0), 2 * SECOND, Knot(0.0))]])
    assert cut.positions(SECOND - 1) == pytest.approx([1.0])
    assert cut.positions(SECOND + SECOND // 2) == [0.5]
    assert cut.positions(3 * SECOND) == [0.0]


def test_joints_move_independently() -> None:
    own = [
        [join_segment(0, Knot(0.0), 4 * SECOND, Knot(4.0))],
        [rest_segment(0, 7.0)],
        [
            join_segment(SECOND, Knot(0.0, 0.0), 3 * SECOND, Knot(2.0, 0.0)),
            join_segment(3 * SECOND, Knot(2.0), 5 * SECOND, Knot(0.0)),
        ],
        [join_segment(0, Knot(1.0, 0.0, 0.5), 2 * SECOND, Knot(1.0, 0.0, -0.5))],
    ]
    together = Trajectory(own)
    alone = [Trajectory([segments]) for segments in own]
    for time in range(-SECOND, 7 * SECOND, SECOND // 4):
        for got, *expected in zip(together.state(time), *(one.state(time) for one in alone), strict=True):
            assert got == [value for (value,) in expected]


def test_segment_of_zero_duration_is_jump() -> None:
    assert join_segment(5, Knot(1.0, 1.0, 1.0), 5, Knot(2.0, 2.0, 2.0)) == rest_segment(5, 2.0)


@given(starts, durations, numbers, numbers)
def test_stop_ends_at_rest_without_reversing(start: int, duration: int, position: float, velocity: float) -> None:
    segment = stop_segment(start, position, velocity, duration)
    t = duration / SECOND
    at_start, at_end = reference(segment, start), reference(segment, segment.end)
    assert at_start[:2] == (position, velocity if velocity else 0.0)
    if velocity:
        assert segment.end == start + duration
        assert at_end[0] == pytest.approx(segment.final)
        assert segment.final == pytest.approx(position + 0.625 * velocity * t)
        assert at_end[1] == pytest.approx(0.0, abs=1e-12 * abs(velocity) + 1e-300)
        assert abs(at_end[2]) == pytest.approx(1.5 * abs(velocity) / t)
    middle = [reference(segment, start + k * duration // 16)[1] for k in range(16)]
    min_speed = sys.float_info.min  # speeds below it are rounded coarsely
    assert all(abs(b) <= abs(a) + min_speed and b * velocity >= 0.0 for a, b in pairwise(middle))


def test_stop_of_zero_duration_is_rest() -> None:
    assert stop_segment(7, 1.5, 2.0, 0) == rest_segment(7, 1.5)


@pytest.mark.slow
@given(st.lists(st.lists(st.tuples(durations, knots, knots), min_size=1, max_size=3), min_size=1, max_size=7))
def test_restored_trajectory_is_identical(joints: list[list[tuple[int, Knot, Knot]]]) -> None:
    trajectory = Trajectory(
        [
            [join_segment(k * SECOND, a, k * SECOND + t, b) for k, (t, a, b) in enumerate(segments)]
            for segments in joints
        ]
    )
    other = Trajectory.from_state(json.loads(json.dumps(trajectory.get_state())))
    assert other.joints == trajectory.joints
    assert (other.start, other.end) == (trajectory.start, trajectory.end)
    for time in range(0, 4 * SECOND, SECOND // 3):
        assert other.state(time) == trajectory.state(time)


@given(
    st.lists(
        st.tuples(
            st.lists(st.tuples(durations, numbers, numbers, numbers), min_size=1, max_size=4),
            st.sampled_from([1, 2, 3]),
            starts,
        ),
        min_size=1,
        max_size=3,
    ),
    starts,
    st.integers(1, SECOND),
    st.integers(1, 80),
)
def test_times_sampled_together_equal_those_one_by_one_to_the_bit(
    motions: list[tuple[list[tuple[int, float, float, float]], int, int]], first: int, period: int, count: int
) -> None:
    joints = []
    for points, specified, start in motions:
        times = [start, *(start + sum(each[0] for each in points[: k + 1]) for k in range(len(points)))]
        knots_ = [Knot(0.0, 0.0, 0.0), *(Knot(*values[:specified]) for _, *values in points)]
        segments = [join_segment(s, a, e, b) for (s, e), (a, b) in zip(pairwise(times), pairwise(knots_), strict=True)]
        joints.append([rest_segment(start, 0.0), *segments])
    trajectory = Trajectory(joints)
    asked = [first + k * period for k in range(count)]
    positions, velocities = trajectory.sample(asked)
    assert positions.tobytes() == np.array([trajectory.positions(time) for time in asked]).tobytes()
    assert velocities.tobytes() == np.array([trajectory.velocities(time) for time in asked]).tobytes()


def test_sample_of_huge_coefficients_overflows_silently() -> None:
    trajectory = Trajectory([[join_segment(0, Knot(0.0, 1e300), SECOND, Knot(1e308, -1e300))]])
    asked = list(range(0, SECOND, SECOND // 20))
    np.testing.assert_array_equal(trajectory.sample(asked)[0], [trajectory.positions(time) for time in asked])
