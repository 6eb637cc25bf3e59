"""Joint groups: each joint in one, by the configuration first and by its name after it."""

import pytest

from cellwright.config.robot.robots import load_robot
from cellwright.robot.node import RobotNode
from cellwright.viewer.services.robot_panel import JointGroup, joint_groups, side_name
from tests.robot.robots import two_arms


def groups_of(name: str) -> tuple[list[str], tuple[JointGroup, ...]]:
    config = load_robot(name, print)
    free = [joint.name for joint in config.robot.driven if joint.mimic is None]
    return free, joint_groups(config, {joint: place for place, joint in enumerate(free)})


@pytest.mark.parametrize("name", ["qinglong", "tandem"])
def test_joint_groups_hold_each_joint_once_in_robot_order(name: str) -> None:
    free, groups = groups_of(name)
    assert sorted(joint for group in groups for joint in group.joints) == sorted(free)
    for group in groups:
        assert list(group.joints) == sorted(group.joints, key=free.index)


def test_joint_groups_of_humanoid_have_its_limbs() -> None:
    _, groups = groups_of("qinglong")
    found = {group.name: group for group in groups}
    assert list(found) == ["right arm", "left arm", "head", "waist", "right hand", "left hand", "legs"]
    assert (found["left arm"].kind, found["left arm"].side) == ("arm", 1)
    assert len(found["right hand"].joints) == 22, "also those that the gripper does not close"
    assert {"J_knee_l_pitch", "J_knee_r_pitch"} < set(found["legs"].joints)


def test_joints_without_group_are_other_joints() -> None:
    config = two_arms()
    node = RobotNode(config)
    groups = {group.name: group.joints for group in joint_groups(config, node.commander.numbers)}
    assert groups["lift"] == ("lift",)
    assert groups["other joints"] == ("wheel",)
    assert joint_groups(config, {}) == ()


def test_side_name_depends_on_count() -> None:
    assert [side_name(place, 3) for place in range(3)] == ["right", "left", "3"]
    assert side_name(0, 1) == "", "what is alone has no side"
