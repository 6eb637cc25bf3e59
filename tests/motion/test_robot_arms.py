"""Arms of a robot as chains: their tips are where the whole robot has them, and what no chain describes is left out."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright import load_robot
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import JointType, link_poses
from cellwright.motion.robot_arms import RobotArm, robot_arms
from cellwright.util.pose import Pose
from tests.robot.robots import two_arms

ROBOTS = {"tandem": load_robot("tandem"), "qinglong": load_robot("qinglong"), "two arms": two_arms()}
SHARES = st.lists(st.floats(0.0, 1.0), min_size=12, max_size=12)


def placed(robot: RobotConfig, arm: RobotArm, shares: list[float]) -> tuple[Pose, Pose]:
    """Return world_T_tip by the chains, and by the robot, with each joint at a share of its range."""
    joints = [*(arm.mount.joints if arm.mount else ()), *arm.chain.joints]
    values = {
        each.name: each.lower + share * (each.upper - each.lower) for each, share in zip(joints, shares, strict=False)
    }
    pose = arm.world_T_begin
    for chain in filter(None, (arm.mount, arm.chain)):
        pose = pose @ chain.tool([values[each.name] for each in chain.joints])
    side = ("right", "left").index(arm.name)
    tip = robot.command_links[side] if robot.command_links else robot.arms[side].tip
    return pose, link_poses(robot.robot, values, robot.base_pose)[tip]


@pytest.mark.parametrize("name", ROBOTS)
@settings(max_examples=20, deadline=None)
@given(shares=SHARES)
def test_tips_are_where_the_robot_has_them(name: str, shares: list[float]) -> None:
    robot = ROBOTS[name]
    arms = robot_arms(robot)
    assert [arm.name for arm in arms] == ["right", "left"]
    for arm in arms:
        found, expected = placed(robot, arm, shares)
        assert found.position == pytest.approx(expected.position, abs=1e-9)


def test_mount_has_the_joints_that_carry_the_arm() -> None:
    assert [joint.name for joint in robot_arms(ROBOTS["tandem"])[0].mount.joints] == ["lift"]  # type: ignore[union-attr]
    assert robot_arms(ROBOTS["qinglong"])[0].mount is None


def test_joints_below_a_fixed_link_carry_no_arm() -> None:
    robot = replace(two_arms(), fixed_link="torso", base_pose=Pose((1.0, 2.0, 3.0)))
    (right, _) = robot_arms(robot)
    assert right.mount is None
    assert right.world_T_begin.position == pytest.approx((1.0, 2.0, 3.0))


def test_arm_with_joints_of_others_on_its_way_is_left_out() -> None:
    robot = two_arms()
    right, left = robot.arms
    shorter = replace(right, joints=right.joints[:-1], home=right.home[:-1])
    assert [arm.name for arm in robot_arms(replace(robot, arms=(shorter, left)))] == ["left"]


def test_arm_above_a_joint_that_nothing_drives_is_left_out() -> None:
    robot = two_arms()
    joints = (replace(each, type=JointType.SPHERICAL) if each.name == "waist" else each for each in robot.robot.joints)
    assert robot_arms(replace(robot, robot=replace(robot.robot, joints=tuple(joints)))) == ()
