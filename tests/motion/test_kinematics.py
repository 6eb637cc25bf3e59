import math
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cellwright.cell.model.arm import add_arm
from cellwright.config.arm import ArmSettings
from cellwright.config.ur10 import UR10
from cellwright.engine.shapes import Visuals
from cellwright.motion import Joints, arm_frame, face, forward, inverse, is_usual, link_poses, tool_down
from cellwright.motion.kinematics import LENGTHS
from cellwright.motion.paths import angle_between
from cellwright.util.errors import UnreachableError, UsageError
from cellwright.util.pose import Pose
from tests.conftest import load_cases
from tests.motion.samples import INITIAL, anywhere
from tests.support.places import LAYOUT


def pose_difference(a: Pose, b: Pose) -> float:
    """Return the difference between poses: the larger of distance [m] and angle [rad]."""
    return max(math.dist(a.position, b.position), angle_between(a, b))


@pytest.mark.parametrize("case", load_cases("ur10_rail_fk.json"), ids=lambda case: str(case["name"]))
def test_forward_kinematics_equal_published_ones(case: dict[str, Any]) -> None:
    poses = link_poses(case["joints"])
    for link in ("wrist_3_link", "vacuum_gripper_link"):
        matrix = np.array(case[link])
        pose = poses[link]
        assert np.allclose(pose.position, matrix[:3, 3], atol=1e-6)
        axes = [pose.rotate(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
        assert np.allclose(np.transpose(axes), matrix[:3, :3], atol=1e-6)
    assert forward(case["joints"]) == poses["vacuum_gripper_link"]


def test_link_poses_equal_those_of_engine() -> None:
    spec = mujoco.MjSpec()
    add_arm(spec, Visuals(), ArmSettings(), 0.01, LAYOUT.arms[0])
    model = spec.compile()
    data = mujoco.MjData(model)
    for joint, value in zip(UR10.driven, (0.7, -1.0, -0.6, 1.9, 0.4, 2.2, -3.0), strict=True):
        data.joint(joint.name).qpos[0] = value
    mujoco.mj_kinematics(model, data)
    poses = link_poses(Joints(0.7, -1.0, -0.6, 1.9, 0.4, 2.2, -3.0))
    for link, pose in poses.items():
        assert np.allclose(data.body(link).xpos, pose.position, atol=1e-9), link


@given(anywhere)
@example(Joints(*(0.0,) * 7))
@example(Joints(0.0, 0.5, -1.0, 0.0, 0.3, 0.7, 0.0))  # stretched out
@example(Joints(0.0, 0.5, -1.0, 2.0, 0.3, math.pi, 1.0))  # wrists 1 and 3 in line
@example(Joints(1.434, 0.0, 0.0, 0.0, -math.pi / 2, 0.0, 1.0))  # both
def test_inverse_recovers_joints_of_forward(joints: Joints) -> None:
    expected = forward(joints)
    found = inverse(expected, joints.rail)
    assert 1 <= len(found) <= 8
    assert all(pose_difference(forward(each), expected) < 2e-7 for each in found)
    stretch, in_line = abs(math.sin(joints.elbow)), abs(math.sin(joints.wrist_2))
    beside = wrist_distance_squared(joints) - 0.163941**2
    if min(stretch, in_line, beside) > 1e-3:
        assert all(pose_difference(forward(each), expected) < 1e-9 for each in found)
        assert min(largest_difference(each, joints) for each in found) < 1e-6


@pytest.mark.slow
@given(anywhere)
def test_inverse_is_exact_near_a_posture(joints: Joints) -> None:
    if min(abs(math.sin(joints.elbow)), abs(math.sin(joints.wrist_2))) < 1e-3:
        return
    if wrist_distance_squared(joints) - 0.163941**2 < 1e-3:
        return
    found = inverse(forward(joints), joints.rail, near=joints)
    assert all(each.within_limits() for each in found)
    assert min(max(abs(p - q) for p, q in zip(each, joints, strict=True)) for each in found) < 1e-6


def test_inverse_of_initial_posture_has_eight_solutions() -> None:
    assert len(inverse(forward(INITIAL), 0.0)) == 8
    for each in inverse(forward(INITIAL), 0.0):
        assert all(-math.pi <= angle <= math.pi for angle in each[1:])


@pytest.mark.parametrize("wrist_2", [0.0, math.pi])
def test_wrist_3_stays_with_wrists_in_line(wrist_2: float) -> None:
    joints = Joints(0.2, 0.4, -1.0, 1.6, 0.7, wrist_2, 0.5)
    found = inverse(forward(joints), 0.2, near=joints)
    assert min(largest_difference(each, joints) for each in found) < 1e-6
    assert any(abs(each.wrist_3) < 1e-6 for each in inverse(forward(joints), 0.2))


def test_wrist_3_changes_where_only_that_reaches_with_wrists_in_line() -> None:
    """Stretched out with the hand in line: no other angle of the hand brings the wrist back into reach."""
    joints = Joints(0.0, 0.0, -0.3, 0.0, -math.pi / 2, 0.0, 1.2)
    (found,) = inverse(forward(joints), 0.0)
    assert pose_difference(forward(found), forward(joints)) < 1e-7
    assert found.wrist_3 == pytest.approx(1.2, abs=1e-6)


def test_inverse_refuses_far_pose_with_distance() -> None:
    radius = LENGTHS.max_reach + LENGTHS.d5
    assert inverse(tool_down(0.3 + math.hypot(radius - 1e-6, 0.163941), 0.0, 1.0273 - 0.005), 0.0)
    with pytest.raises(UnreachableError, match=r"10\.\d mm out of reach"):
        inverse(tool_down(0.3 + math.hypot(radius + 0.01, 0.163941), 0.0, 1.0273 - 0.005), 0.0)


def test_inverse_refuses_pose_near_pan_axis() -> None:
    with pytest.raises(UnreachableError, match="move the rail"):
        inverse(tool_down(0.3, 0.1, 1.2), 0.0)


def test_inverse_refuses_rail_beyond_its_end() -> None:
    with pytest.raises(UnreachableError, match="rail"):
        inverse(tool_down(0.3, 2.9, 1.0), 2.2)
    assert inverse(tool_down(0.3, 2.9, 1.0), 2.1)


def test_inverse_refuses_non_finite_numbers() -> None:
    with pytest.raises(UsageError, match="finite"):
        inverse(Pose((math.nan, 0.0, 0.0)), 0.0)
    with pytest.raises(UsageError, match="finite"):
        inverse(tool_down(0.3, 0.9, 1.0), math.inf)


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-1, 3), st.floats(-3, 3))
def test_tool_down_places_face_at_requested_point(x: float, y: float, z: float, yaw: float) -> None:
    pose = tool_down(x, y, z, yaw)
    assert math.dist(face(pose), (x, y, z)) < 1e-12
    assert pose.rotate((0.0, 0.0, 1.0)) == pytest.approx((0.0, 0.0, 1.0))
    assert pose.yaw == pytest.approx(yaw)


@given(st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), st.floats(-1.0, 1.0), st.floats(-3.0, 3.0))
def test_arm_frame_has_the_rail_where_2017_has_it(x: float, y: float, z: float, yaw: float) -> None:
    rail = Pose.from_rpy((x, y, z), (0.0, 0.0, yaw))
    local = arm_frame(rail).inverse() @ rail
    assert local.position == pytest.approx((0.3, 0.0, 0.9), abs=1e-9)
    assert local.rotate((0.0, 1.0, 0.0)) == pytest.approx((0.0, 1.0, 0.0), abs=1e-9)
    assert arm_frame(Pose((0.3, 0.0, 0.9))) == Pose()


def test_is_usual_selects_elbow_up_postures() -> None:
    pose = tool_down(-0.3, 0.23, 0.8)
    found = inverse(pose, 0.23)
    usual = [each for each in found if is_usual(each)]
    assert len(usual) == 2  # the hand reaches outward or inward
    for each in usual:
        links = link_poses(each)
        assert links["forearm_link"].position[2] > links["wrist_1_link"].position[2]
        assert links["wrist_1_link"].position[0] < 0.3


def largest_difference(a: Joints, b: Joints) -> float:
    """Return the largest difference of an angle, ignoring whole turns [rad]."""
    return max(abs(math.remainder(p - q, 2 * math.pi)) for p, q in zip(a[1:], b[1:], strict=True))


def wrist_distance_squared(joints: Joints) -> float:
    """Return the squared distance of the wrist from the pan axis [m^2]."""
    x, y, _ = link_poses(joints)["wrist_3_link"].position
    return (x - 0.3) ** 2 + (y - joints.rail) ** 2
