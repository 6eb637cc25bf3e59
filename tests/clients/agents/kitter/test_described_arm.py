"""Postures of arms that the cell describes."""

import math
from functools import cache
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.cell.cell import Cell
from cellwright.clients.agents.agent import find_agent
from cellwright.clients.agents.kitter.clearance import places_along
from cellwright.clients.agents.kitter.described_arm import ABOVE, ACCELERATION, DIP, DescribedArm, behind
from cellwright.clients.agents.kitter.motion import at_height, straight_path
from cellwright.config.ur10 import GRIPPER
from cellwright.motion import tool_down
from cellwright.running.run import Outcome, RunOptions, run_cell
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.arms import PEDESTAL, RAIL, described, kitting

ARMS = [("ur5", PEDESTAL), ("ur5", RAIL), ("xarm7", PEDESTAL)]
arms = pytest.mark.parametrize(("model", "mount"), ARMS)

BIN, TRAY, BELT = tool_down(-0.1, 0.5, 0.64), tool_down(-0.1, -0.5, 0.64), tool_down(0.55, 0.3, 0.55)


@cache
def arm(model: str, mount: str = PEDESTAL) -> DescribedArm:
    return described(kitting(model, mount))


@pytest.mark.slow
@pytest.mark.parametrize("model", ["ur5", "xarm7"])
def test_agent_wins_all_points_with_another_arm_and_ends_in_same_state_twice(model: str) -> None:
    first, second = (run_cell(Cell(kitting(model)), find_agent("kitter")(), RunOptions(until=120.0)) for _ in range(2))
    assert (first.error, first.outcome, first.score.total) == ("", Outcome.DONE, 6.0)
    assert second.state_hash == first.state_hash


@arms
@settings(max_examples=20, deadline=None)
@given(x=st.floats(-0.25, 0.1), y=st.floats(0.4, 0.65), side=st.sampled_from([1, -1]), yaw=st.floats(-3.0, 3.0))
def test_usual_postures_reach_the_pose_from_above(
    model: str, mount: str, x: float, y: float, side: int, yaw: float
) -> None:
    postures = arm(model, mount)
    goal = Pose.from_rpy((x, side * y, 0.6), (0.0, 0.0, yaw))
    found = list(postures.usual(goal, postures.rail_beside(x, side * y), postures.figures.home))
    assert found
    for q in found:
        assert math.dist(postures.tool(q).position, goal.position) < 1e-5
        assert postures.tool(q).rotate((1.0, 0.0, 0.0)) == pytest.approx(goal.rotate((1.0, 0.0, 0.0)), abs=1e-5)
        links = postures.chain.link_poses(q)
        above = [pose.position[2] for name, pose in links.items() if postures.chain.links[name].joints == len(q) - 2]
        assert min(above) >= links[GRIPPER].position[2] + ABOVE - 1e-9


def test_pose_out_of_reach_has_no_posture() -> None:
    postures = arm("ur5")
    far = tool_down(1.5, 0.0, 0.6)
    assert not postures.reaches(far, 0.0)
    assert list(postures.usual(far, 0.0, postures.figures.home)) == []
    assert postures.step(far, postures.figures.home) is None
    assert postures.reaches(BIN, 0.0)


@arms
def test_steps_down_a_straight_path_move_joints_little(model: str, mount: str) -> None:
    postures = arm(model, mount)
    q = next(postures.usual(BIN, postures.rail_beside(*BIN.position[:2]), postures.figures.home))
    for _, pose in straight_path(BIN, at_height(BIN, 0.48), 0.35):
        near, stepped = q, postures.step(pose, q)
        assert stepped is not None
        q = stepped
        assert max(abs(a - b) for a, b in zip(near, q, strict=True)) < 0.2
        assert math.dist(postures.tool(q).position, pose.position) < 1e-5


@arms
def test_ways_end_at_the_goal_and_dip_nowhere(model: str, mount: str) -> None:
    postures = arm(model, mount)
    start = next(postures.usual(BIN, postures.rail_beside(*BIN.position[:2]), postures.figures.home))
    goal = next(postures.usual(TRAY, postures.rail_beside(*TRAY.position[:2]), start))
    ways = list(postures.ways(start, goal, 0.0))
    assert ways
    for stops in ways:
        assert stops[-1] == goal
        places = places_along([start, *stops], postures.figures.steps).tolist()
        assert min(postures.tool(q).position[2] for q in places) >= BIN.position[2] - DIP - 1e-6
        assert max(math.dist(postures.tool(a).position, postures.tool(b).position) for a, b in pairwise(places)) < 0.15


def test_ways_between_over_the_left_and_over_the_right_shoulder_are_none_if_the_tool_would_dip() -> None:
    """The UR5 has two usual postures for most poses; between them the arm would fold through its elbow."""
    postures = arm("ur5")
    start = next(postures.usual(BIN, 0.0, postures.figures.home))
    everything = list(postures._from_above(TRAY, 0.0, start))
    assert len(everything) > len(list(postures.usual(TRAY, 0.0, start))) > 0


@arms
def test_motion_rests_at_each_stop_within_the_speed_of_each_joint(model: str, mount: str) -> None:
    postures = arm(model, mount)
    start = postures.figures.home
    stops = [tuple(value + 0.4 for value in start), tuple(value - 0.1 for value in start)]
    times, positions, velocities = postures.motion(start, stops)
    assert [*positions] == [start, *stops]
    assert all(value == 0.0 for row in velocities for value in row)
    for (t0, p0), (t1, p1) in pairwise(zip(times, positions, strict=True)):
        fastest = [1.5 * abs(b - a) / (t1 - t0) for a, b in zip(p0, p1, strict=True)]
        assert all(value <= speed + 1e-9 for value, speed in zip(fastest, postures.figures.speed, strict=True))
        assert max(6.0 * abs(b - a) / (t1 - t0) ** 2 for a, b in zip(p0, p1, strict=True)) <= ACCELERATION + 1e-9


def test_rail_goes_beside_a_point_and_is_no_joint_of_the_arm_behind() -> None:
    postures = arm("ur5", RAIL)
    assert postures.rail_beside(-0.25, 3.0) == pytest.approx(-0.25)
    assert (postures.on_rail(-7.0), postures.on_rail(7.0)) == (-0.4, 0.1)
    assert postures.rail_shift(0.2, 0.7) == pytest.approx(0.2)
    assert next(iter(postures.rails(BIN, -0.25))) == -0.25
    assert [joint.name for joint in behind(postures.chain).joints] == [*postures.figures.joints[1:]]
    assert arm("ur5").on_rail(0.7) == arm("ur5").rail_beside(0.3, 0.2) == 0.0


def test_wrist_is_rolled_to_the_side_with_more_room() -> None:
    postures = arm("xarm7")
    q = (*postures.figures.home[:-1], 4.0)
    assert postures.rolled(q, math.pi) == (*q[:-1], 4.0 - math.pi)
    assert postures.rolled((*q[:-1], -1.0), math.pi)[-1] == math.pi - 1.0


def test_parts_are_dropped_around_the_arm() -> None:
    places = arm("ur5").figures.drop_places
    assert all(0.3 < math.hypot(x, y) < 0.9 and rail == 0.0 for x, y, rail in places)
    assert {rail for _, _, rail in arm("ur5", RAIL).figures.drop_places} == {0.0, -0.4, 0.1}
