from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.motion import Joints
from cellwright.motion.joint_motion import knot_velocities
from cellwright.motion.joints import STILL

values = st.floats(-3.0, 3.0)
knots = st.lists(st.tuples(st.floats(0.05, 1.0), values), min_size=2, max_size=12)


def joints(value: float) -> Joints:
    return Joints(value, *(0.0,) * 6)


@given(knots)
def test_knot_velocities_give_continuous_acceleration(steps: list[tuple[float, float]]) -> None:
    times = [sum(step for step, _ in steps[:count]) for count in range(1, len(steps) + 1)]
    positions = [position for _, position in steps]
    velocities = [row.rail for row in knot_velocities(times, [joints(p) for p in positions], STILL, STILL)]
    assert velocities[0] == velocities[-1] == 0.0
    ends = []
    for index in range(len(times) - 1):
        h = times[index + 1] - times[index]
        mean = (positions[index + 1] - positions[index]) / h
        v0, v1 = velocities[index], velocities[index + 1]
        ends.append(((6 * mean - 4 * v0 - 2 * v1) / h, (2 * v0 + 4 * v1 - 6 * mean) / h))
    for (_, left), (right, _) in pairwise(ends):
        assert left == pytest.approx(right, abs=1e-6 * (1 + abs(left)))


def test_knot_velocities_of_straight_line_are_constant() -> None:
    times = (0.0, 0.3, 1.0, 1.2)
    for row in knot_velocities(times, [joints(2.0 * time) for time in times]):
        assert row == pytest.approx(joints(2.0))


def test_knot_velocities_of_parabola_are_exact() -> None:
    times = (0.0, 0.5, 0.7, 2.0)
    rows = knot_velocities(times, [joints(time**2) for time in times], joints(0.0), joints(4.0))
    assert [row.rail for row in rows] == pytest.approx([2.0 * time for time in times])
