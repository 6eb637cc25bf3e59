"""Tool paths: straight ones, and those that follow a part."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.agents.kitter.motion import (
    FOLLOW_LEAD,
    FOLLOW_TIME,
    at_height,
    facing_down,
    following_path,
    interpolate,
    straight_path,
)
from cellwright.util.pose import Pose

coordinates = st.floats(-1.0, 1.0)
places = st.builds(
    lambda x, y, z, yaw: Pose.from_rpy((x, y, z), (0.0, 0.0, yaw)), coordinates, coordinates, coordinates, coordinates
)


@given(places, places, st.floats(0.01, 0.5))
def test_straight_path_is_straight_and_within_speed(start: Pose, goal: Pose, speed: float) -> None:
    way = list(straight_path(start, goal, speed))
    times = [0.0, *(time for time, _ in way)]
    assert all(before < after for before, after in pairwise(times))
    length = math.dist(start.position, goal.position)
    assert times[-1] >= length / speed
    end = way[-1][1]
    assert end.position == pytest.approx(goal.position)
    assert end.yaw == pytest.approx(goal.yaw)
    for _, pose in way:
        detour = math.dist(start.position, pose.position) + math.dist(pose.position, goal.position) - length
        assert detour == pytest.approx(0.0, abs=1e-7)
        assert pose.rpy[:2] == pytest.approx((0.0, 0.0), abs=1e-9)


def test_interpolate_turns_short_way() -> None:
    start, goal = (Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, yaw)) for yaw in (3.0, -3.0))
    assert abs(interpolate(start, goal, 0.5).yaw) == pytest.approx(math.pi)


def test_cup_that_ends_sideways_is_sideways_on_the_way() -> None:
    start, goal = (
        Pose.from_rpy((0.0, 0.0, 1.0), (0.0, 0.0, 0.3)),
        Pose.from_rpy((0.1, 0.0, 0.8), (0.0, -math.pi / 2, 0.3)),
    )
    way = [pose for _, pose in straight_path(start, goal, 0.3)]
    assert all(pose.quaternion == goal.quaternion for pose in way)
    assert way[-1].position == pytest.approx(goal.position)
    assert interpolate(start, goal, 0.5).position == pytest.approx((0.05, 0.0, 0.9))


def test_following_path_catches_up_and_follows_part() -> None:
    start = Pose.from_rpy((1.21, 0.5, 1.0), (0.0, 0.0, 0.3))
    way = list(following_path(start, 0.93, 0.92, 0.2))
    assert way[-1][0] == pytest.approx(FOLLOW_TIME)
    for time, pose in way:
        x, y, z = pose.position
        assert x == 1.21
        assert 0.92 - 1e-12 <= z <= 1.0
        if time >= 2 * FOLLOW_LEAD:  # up to speed: right above what passed the start at `FOLLOW_LEAD`
            assert y == pytest.approx(0.5 - 0.2 * (time - FOLLOW_LEAD))
    assert way[-1][1].position[2] == pytest.approx(0.92)
    near = [pose.position[2] for time, pose in way if 0.5 < time < 0.6]
    assert near == [pytest.approx(0.93, abs=1e-3)]


def test_at_height_and_facing_down_change_one_component() -> None:
    tilted = Pose.from_rpy((1.0, 2.0, 3.0), (0.1, 0.2, 0.3))
    assert at_height(tilted, 5.0) == Pose((1.0, 2.0, 5.0), tilted.quaternion)
    assert facing_down(tilted).position == tilted.position
    assert facing_down(tilted).rpy == pytest.approx((0.0, 0.0, 0.3))
