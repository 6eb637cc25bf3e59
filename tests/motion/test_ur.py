import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.motion.turns import principal
from cellwright.motion.ur import UrConstants, ur_links, ur_postures
from cellwright.util.errors import UnreachableError
from cellwright.util.pose import Pose
from tests.motion.ur_arms import UR_ARMS

ANGLES = st.tuples(*(st.floats(-math.pi, math.pi, allow_subnormal=False),) * 6)
NAMES = st.sampled_from(sorted(UR_ARMS))


def wrist_3(ur: UrConstants, angles: tuple[float, ...]) -> Pose:
    """Return shoulder_T_wrist_3."""
    return ur_links(ur, Pose((0.0, 0.0, -ur.d1)), angles)["wrist_3_link"]


@given(NAMES, ANGLES)
def test_postures_bring_wrist_3_to_its_pose(name: str, angles: tuple[float, ...]) -> None:
    ur = UR_ARMS[name]
    target = wrist_3(ur, angles)
    postures = ur_postures(ur, target, angles[5])
    assert 1 <= len(postures) <= 8
    for posture in postures:
        apart = target.relative(wrist_3(ur, posture))
        assert math.hypot(*apart.position, *apart.quaternion[1:]) < 1e-6
        assert all(-math.pi <= each <= math.pi for each in posture)


@given(NAMES, ANGLES)
def test_postures_contain_that_of_forward_kinematics(name: str, angles: tuple[float, ...]) -> None:
    if min(abs(math.sin(angles[4])), abs(math.sin(angles[2]))) < 1e-3:
        return  # there, solutions meet
    ur = UR_ARMS[name]
    target = wrist_3(ur, angles)
    beside = math.hypot(*target.position[:2]) - ur.d4
    if beside < 1e-6:
        return  # there, shoulders meet
    apart = [max(abs(principal(p - q)) for p, q in zip(angles, each, strict=True)) for each in ur_postures(ur, target)]
    assert min(apart) < 1e-4


def test_lengths_and_offsets_of_ur10_are_published_ones() -> None:
    # the description of ROS 1: wrist 3 with all joints at 0 is (a2 + a3, d4, d1 - d5) from the base
    x, y, z = wrist_3(UR_ARMS["UR10"], (0.0,) * 6).position
    assert (x, y, z) == pytest.approx((1.1843, 0.163941, -0.1157))


def test_pose_out_of_reach_says_by_how_much() -> None:
    ur = UR_ARMS["UR5"]
    far = Pose((2.0, ur.d4, 0.0))
    with pytest.raises(UnreachableError, match=r"^the wrist is \d+\.\d mm out of reach$"):
        ur_postures(ur, far)
    with pytest.raises(UnreachableError, match=r"out of reach with the rail at 0\.250 m$"):
        ur_postures(ur, far, rail=0.25)


def test_pose_at_pan_axis_is_refused_with_remedy_for_rail() -> None:
    ur = UR_ARMS["UR5"]
    near = Pose((0.0, 0.05, 0.5))
    with pytest.raises(UnreachableError, match=r"at least 0\.109 m from the pan axis \(got 0\.050 m\)$"):
        ur_postures(ur, near)
    with pytest.raises(UnreachableError, match=r"; move the rail$"):
        ur_postures(ur, near, rail=0.0)


def test_arm_with_longer_forearm_is_solved() -> None:
    ur = UrConstants(0.1, 0.3, 0.4, 0.1, 0.09, 0.08)
    angles = (0.3, -1.0, 1.2, -0.7, 1.1, 0.4)
    apart = [math.dist(angles, each) for each in ur_postures(ur, wrist_3(ur, angles))]
    assert min(apart) < 1e-9
