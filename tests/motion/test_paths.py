import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.motion import Joints, follow, forward, solve, straight, tool_down
from cellwright.motion.paths import angle_between, between
from cellwright.util.errors import UnreachableError, UsageError
from cellwright.util.pose import Pose
from tests.motion.samples import ABOVE_BIN, INITIAL, farthest

angles = st.floats(-3.0, 3.0)
lengths = st.floats(-2.0, 2.0)
poses = st.builds(
    lambda x, y, z, a, b, c: Pose.from_rpy((x, y, z), (a, b, c)), lengths, lengths, lengths, angles, angles, angles
)


@given(poses, poses)
def test_between_includes_both_ends(a: Pose, b: Pose) -> None:
    for share, end in ((0.0, a), (1.0, b)):
        assert math.dist(between(a, b, share).position, end.position) < 1e-12
        assert angle_between(between(a, b, share), end) < 1e-7


@given(poses, poses, st.floats(0.0, 1.0))
def test_between_moves_and_turns_evenly(a: Pose, b: Pose, share: float) -> None:
    middle = between(a, b, share)
    assert math.dist(a.position, middle.position) == pytest.approx(share * math.dist(a.position, b.position), abs=1e-9)
    whole = angle_between(a, b)
    assert whole <= math.pi + 1e-9
    assert angle_between(a, middle) == pytest.approx(share * whole, abs=1e-6)


@settings(max_examples=40)
@given(st.floats(-0.15, 0.15), st.floats(-0.2, 0.2), st.floats(0.74, 1.1), st.floats(-1.0, 1.0))
def test_straight_keeps_gripper_on_its_line(dx: float, dy: float, z: float, turn: float) -> None:
    here = forward(ABOVE_BIN)
    goal = tool_down(-0.3 + dx, 0.23 + dy, z, turn)
    path = straight(ABOVE_BIN, goal)
    assert path[0] == ABOVE_BIN
    for index, joints in enumerate(path):
        share = index / (len(path) - 1)
        expected = between(here, goal, share)
        assert math.dist(forward(joints).position, expected.position) < 1e-9
        assert joints.rail == ABOVE_BIN.rail
    assert all(farthest(a, b) < 0.2 for a, b in pairwise(path))
    assert len(path) - 1 >= math.dist(here.position, goal.position) / 0.01 - 1e-6


def test_straight_moves_rail_in_proportion() -> None:
    goal = tool_down(-0.3, 0.73, 1.0)
    path = straight(ABOVE_BIN, goal, rail=ABOVE_BIN.rail + 0.5)
    steps = [b.rail - a.rail for a, b in pairwise(path)]
    assert steps == pytest.approx([0.5 / len(steps)] * len(steps))
    assert path[-1].rail == pytest.approx(ABOVE_BIN.rail + 0.5)
    assert math.dist(forward(path[-1]).position, goal.position) < 1e-9


def test_straight_to_present_pose_stays() -> None:
    assert straight(ABOVE_BIN, forward(ABOVE_BIN))[-1] == pytest.approx(ABOVE_BIN)


def test_straight_out_of_reach_names_place() -> None:
    with pytest.raises(UnreachableError, match=r"leaves the arm's reach at x -\d\.\d+, y 0\.230"):
        straight(ABOVE_BIN, tool_down(-1.5, 0.23, 1.0))


def test_straight_refuses_jump_to_another_posture() -> None:
    """On a straight line past the pan axis the arm would have to swing round instantly."""
    start = solve(tool_down(0.1, 0.3, 1.5), INITIAL, rail=0.0)
    with pytest.raises(UnreachableError):
        straight(start, tool_down(0.5, -0.3, 1.5))
    turned = ABOVE_BIN._replace(wrist_3=2 * math.pi - 0.1)
    x, y, z = forward(turned).position
    on = Pose((x, y, z), between(forward(turned), forward(turned._replace(wrist_3=2 * math.pi)), 1.0).quaternion)
    assert straight(turned, on)[-1].wrist_3 == pytest.approx(2 * math.pi)
    past = forward(turned._replace(wrist_3=2 * math.pi + 0.3))
    with pytest.raises(UnreachableError, match="jump by"):
        straight(turned, past)


def test_follow_uses_rail_position_of_each_pose() -> None:
    rails = [ABOVE_BIN.rail + 0.02 * index for index in range(1, 6)]
    found = follow(ABOVE_BIN, [forward(ABOVE_BIN)] * 5, rails)
    assert [joints.rail for joints in found] == [ABOVE_BIN.rail, *rails]
    assert follow(ABOVE_BIN, [], []) == (ABOVE_BIN,)
    with pytest.raises(UsageError, match="same length"):
        follow(ABOVE_BIN, [forward(ABOVE_BIN)], rails)


def test_straight_refuses_invalid_arguments() -> None:
    with pytest.raises(UsageError, match="spacing"):
        straight(ABOVE_BIN, forward(INITIAL), spacing=0.0)
    with pytest.raises(UsageError, match="finite"):
        straight(ABOVE_BIN, Pose((math.inf, 0.0, 0.0)))
    with pytest.raises(UsageError, match="finite"):
        straight(Joints(*(math.nan,) * 7), forward(INITIAL))
