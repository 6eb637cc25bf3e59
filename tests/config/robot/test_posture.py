"""Forward kinematics: poses of links in a posture."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.robot.model import Joint, JointType, Limits, Mimic, link_poses, parent_T_child, position_of
from cellwright.util.pose import Pose
from tests.cell.model.robots import of_joints
from tests.robot.robots import two_arms

UP = Pose((0.0, 0.0, 1.0))
X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)


@pytest.mark.parametrize(
    ("kind", "position", "tip"),
    [
        (JointType.REVOLUTE, math.pi / 2, (1.0, 0.0, 1.0)),  # about y: the axis that points up points forward
        (JointType.CONTINUOUS, -math.pi / 2, (-1.0, 0.0, 1.0)),
        (JointType.PRISMATIC, 0.5, (0.0, 0.5, 2.0)),
        (JointType.FIXED, 0.5, (0.0, 0.0, 2.0)),
        (JointType.SPHERICAL, 0.5, (0.0, 0.0, 2.0)),
        (JointType.PLANAR, 0.5, (0.0, 0.0, 2.0)),
    ],
)
def test_child_frame_moves_by_joint_type(kind: JointType, position: float, tip: tuple[float, float, float]) -> None:
    joint = Joint("j", kind, "a", "b", UP, Y)
    assert parent_T_child(joint, position).transform((0.0, 0.0, 1.0)) == pytest.approx(tip)
    assert parent_T_child(joint, 0.0) == UP


def test_link_poses_accumulate_from_root() -> None:
    robot = of_joints(
        Joint("one", JointType.REVOLUTE, "a", "b", UP, X), Joint("two", JointType.REVOLUTE, "b", "c", UP, X)
    ).robot
    poses = link_poses(robot, {"one": math.pi / 2, "two": math.pi / 2}, Pose((5.0, 0.0, 0.0)))
    assert poses["a"].position == (5.0, 0.0, 0.0)
    assert poses["b"].position == (5.0, 0.0, 1.0)
    assert poses["c"].position == pytest.approx((5.0, -1.0, 1.0))
    assert poses["c"].rotate((0.0, 0.0, 1.0)) == pytest.approx((0.0, 0.0, -1.0))


def test_mimic_joint_follows_unless_position_is_given() -> None:
    leader = Joint("leader", JointType.REVOLUTE, "a", "b")
    follower = Joint("follower", JointType.REVOLUTE, "a", "c", limits=Limits(), mimic=Mimic("leader", -2.0, 0.5))
    robot = of_joints(leader, follower).robot
    assert position_of(robot, follower, {"leader": 0.25}) == 0.0
    assert position_of(robot, follower, {}) == 0.5
    assert position_of(robot, follower, {"leader": 0.25, "follower": 1.0}) == 1.0


@given(st.lists(st.floats(-3.0, 3.0), min_size=14, max_size=14), st.tuples(*[st.floats(-3.0, 3.0)] * 6))
def test_link_poses_move_with_root_pose(numbers: list[float], place: tuple[float, ...]) -> None:
    robot = two_arms().robot
    posture = dict(zip((joint.name for joint in robot.driven), numbers, strict=True))
    x, y, z, roll, pitch, yaw = place
    world_T_root = Pose.from_rpy((x, y, z), (roll, pitch, yaw))
    at_origin, moved = link_poses(robot, posture), link_poses(robot, posture, world_T_root)
    for link, root_T_link in at_origin.items():
        expected = world_T_root @ root_T_link
        assert moved[link].position == pytest.approx(expected.position, abs=1e-9)
        assert moved[link].quaternion == pytest.approx(expected.quaternion, abs=1e-9)
