"""Sides in names, and groups that mix them."""

from pathlib import Path

import pytest

from cellwright.config.robot.groups import mixed_sides, side_of
from cellwright.config.robot.model import RobotModel
from cellwright.config.robot.urdf import read_urdf
from tests.config.robot.torso_robot import urdf, write


@pytest.mark.parametrize(
    ("name", "side"),
    [
        ("J_arm_r_01", "right"),
        ("J_arm_l_01", "left"),
        ("openarm_right_finger_joint1", "right"),
        ("leftArm3", "left"),
        ("L2", "left"),
        ("r_gripper_l_finger_joint", "right"),
        ("right_gripper_left_finger", "right"),
        ("torso_roll", ""),
        ("lift", ""),
        ("wrist_roll_joint", ""),
    ],
)
def test_side_of_name_is_first_one_stated(name: str, side: str) -> None:
    assert side_of(name) == side


def mixed_sides_reason(robot: RobotModel, *names: str) -> str:
    return mixed_sides(robot, [robot.joint(name) for name in names])


def test_mixed_sides_are_detected_by_names(tmp_path: Path) -> None:
    robot = read_urdf(write(tmp_path, urdf()), warn=lambda _line: None)
    assert mixed_sides_reason(robot, "left_gripper_joint1", "right_gripper_joint1") == (
        "right_gripper_joint1 is on the right, left_gripper_joint1 on the left"
    )
    assert mixed_sides_reason(robot, "left_gripper_joint1", "left_gripper_joint2") == ""
    assert mixed_sides_reason(robot, "torso_joint1", "left_arm_joint1") == ""


def test_mixed_limbs_are_detected_without_names(tmp_path: Path) -> None:
    robot = read_urdf(write(tmp_path, urdf(("one", "two"))), warn=lambda _line: None)
    assert mixed_sides_reason(robot, "one_gripper_joint1", "two_gripper_joint2") == (
        "its joints belong to two limbs, behind one_arm_joint1 and behind two_arm_joint1"
    )
    assert mixed_sides_reason(robot, "one_gripper_joint1", "one_gripper_joint2") == ""


def test_left_and_right_finger_of_one_palm_are_not_mixed(tmp_path: Path) -> None:
    text = urdf(("main",)).replace("main_gripper_joint1", "left_finger").replace("main_gripper_joint2", "right_finger")
    robot = read_urdf(write(tmp_path, text), warn=lambda _line: None)
    assert mixed_sides_reason(robot, "left_finger", "right_finger") == ""


def test_finger_with_spreading_joint_is_not_mixed(tmp_path: Path) -> None:
    """Return two fingers, called left and right, that each hang on a joint which does not close them."""
    text = urdf(("main",), fingers=())
    for side in ("left", "right"):
        for name, parent in ((f"{side}_spread", "main_arm_link7"), (f"{side}_finger", f"{side}_spread_link")):
            joint = (
                f'<link name="{name}_link"/><joint name="{name}" type="revolute"><parent link="{parent}"/>'
                f'<child link="{name}_link"/><axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/>'
                "</joint></robot>"
            )
            text = text.replace("</robot>", joint)
    robot = read_urdf(write(tmp_path, text), warn=lambda _line: None)
    assert mixed_sides_reason(robot, "left_finger", "right_finger") == ""
