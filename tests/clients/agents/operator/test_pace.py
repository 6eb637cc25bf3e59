"""Pace of a motion that a person asks for."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.agents.operator.pace import RAMP, TOOL_SPEED, Pace, joint_step, tool_distance, tool_step
from cellwright.util.pose import Pose

PERIOD = 0.02


@given(distance=st.floats(1e-4, 3.0), most=st.floats(0.2, 1.0))
def test_pace_arrives_and_changes_speed_gently(distance: float, most: float) -> None:
    pace, left, speeds = Pace(), distance, [0.0]
    for _ in range(2000):
        way = pace.way(left, PERIOD, most)
        speeds.append(way / PERIOD)
        left -= way
        if left <= 0.0:
            break
    assert left == pytest.approx(0.0, abs=1e-9)
    assert max(speeds) <= most + 1e-9
    rises = [after - before for before, after in pairwise(speeds)]
    assert max(rises) <= PERIOD / RAMP + 1e-9
    # the last steps are coarser: braking is computed from where a period begins
    assert min(rises) >= -4.0 * math.sqrt(PERIOD / RAMP) * PERIOD / RAMP - 2 * PERIOD / RAMP


def test_tool_goes_straight() -> None:
    present, goal, pace = Pose(), Pose((0.3, 0.4, 0.0)), Pace()
    places = []
    while present != goal:
        present = tool_step(present, goal, pace, PERIOD)
        places.append(present.position)
    assert all(4 * x == pytest.approx(3 * y) for x, y, _ in places)
    assert max(math.dist(a, b) for a, b in pairwise(places)) <= TOOL_SPEED * PERIOD + 1e-9


def test_turn_counts_as_distance() -> None:
    assert tool_distance(Pose(), Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, 1.5))) == pytest.approx(1.0)


def test_joints_arrive_together() -> None:
    q, goal, pace = [0.0, 1.0], [1.0, 0.5], Pace()
    while q != goal:
        q = joint_step(q, goal, (1.0, 1.0), pace, PERIOD)
        assert q[1] == pytest.approx(1.0 - 0.5 * q[0])
    assert joint_step(goal, goal, (1.0, 1.0), pace, PERIOD) == goal
