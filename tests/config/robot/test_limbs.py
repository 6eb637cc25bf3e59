"""Limbs of robots with a trunk of many joints: which chain is an arm, and which fingers are a gripper."""

from pathlib import Path

import pytest

from cellwright.config.robot.config import RangeEnd
from cellwright.config.robot.limbs import Limbs, find_limbs
from cellwright.config.robot.urdf import read_urdf
from tests.config.robot.torso_robot import arm_names, urdf, write

TORSO = ("torso_joint1", "torso_joint2", "torso_joint3", "torso_joint4")


def limbs(folder: Path, text: str) -> Limbs:
    return find_limbs(read_urdf(write(folder, text), warn=lambda _line: None))


def fingers(side: str) -> tuple[str, ...]:
    return (f"{side}_gripper_joint1", f"{side}_gripper_joint2")


@pytest.mark.parametrize("sides", [("left", "right"), ("right", "left"), ("L", "R")])
def test_torso_below_two_arms_is_waist(tmp_path: Path, sides: tuple[str, str]) -> None:
    found = limbs(tmp_path, urdf(sides))
    right, left = sorted(sides, key=str.lower, reverse=True)
    assert [arm.joints for arm in found.arms] == [arm_names(right), arm_names(left)]
    assert [gripper.joints for gripper in found.grippers] == [fingers(right), fingers(left)]
    assert found.waist is not None
    assert found.waist.joints == TORSO


def test_arms_without_sides_in_names_are_sorted_by_y(tmp_path: Path) -> None:
    found = limbs(tmp_path, urdf(("one", "two")))
    assert [arm.joints for arm in found.arms] == [arm_names("two"), arm_names("one")]  # "two" is at y = -0.2 m
    assert [gripper.joints for gripper in found.grippers] == [fingers("two"), fingers("one")]
    assert found.waist is not None
    assert found.waist.joints == TORSO


def test_joint_between_trunk_and_fork_belongs_to_waist(tmp_path: Path) -> None:
    """A camera on the torso's third link makes a fork of its own, behind which the arms hang on one more joint."""
    camera = (
        '<link name="mast"/><joint name="camera" type="revolute"><parent link="torso_link3"/><child link="mast"/>'
        '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="5" velocity="1"/></joint></robot>'
    )
    found = limbs(tmp_path, urdf().replace("</robot>", camera))
    assert [arm.joints for arm in found.arms] == [arm_names("right"), arm_names("left")]
    assert found.waist is not None
    assert found.waist.joints == TORSO


def test_torso_with_single_arm_is_part_of_arm(tmp_path: Path) -> None:
    found = limbs(tmp_path, urdf(("main",)))
    assert [arm.joints for arm in found.arms] == [(*TORSO, *arm_names("main"))]
    assert [gripper.joints for gripper in found.grippers] == [fingers("main")]
    assert found.waist is None


def test_arm_with_long_fingers_is_not_trunk(tmp_path: Path) -> None:
    """Two fingers of four joints each are short against the arm that they hang on."""
    text = urdf(("main",), torso=0, fingers=())
    links, joints = [], []
    for finger in ("a", "b"):
        parent = "main_arm_link7"
        for number in range(1, 5):
            child = f"{finger}{number}"
            links.append(f'<link name="{child}"/>')
            joints.append(
                f'<joint name="f_{child}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
                '<origin xyz="0 0 -0.03"/><axis xyz="1 0 0"/><limit lower="0" upper="1.5" effort="1" velocity="2"/>'
                "</joint>"
            )
            parent = child
    found = limbs(tmp_path, text.replace("</robot>", "".join([*links, *joints, "</robot>"])))
    assert [arm.joints for arm in found.arms] == [arm_names("main")]
    assert [len(gripper.joints) for gripper in found.grippers] == [8]


def test_gripper_with_mimic_finger_is_open_at_upper_limit(tmp_path: Path) -> None:
    text = urdf(("main",), torso=0, fingers=(("0 1 0", 0.0, 0.04), ("0 -1 0", 0.0, 0.04)))
    follower = '<limit lower="0.0" upper="0.04" effort="50" velocity="0.25"/><mimic joint="main_gripper_joint1"/>'
    head, _, tail = text.rpartition('<limit lower="0.0"')
    found = limbs(tmp_path, f"{head}{follower}{tail.partition('/>')[2]}")
    assert [arm.joints for arm in found.arms] == [arm_names("main")]
    (gripper,) = found.grippers
    assert gripper.joints == fingers("main")
    assert gripper.open_ends == (RangeEnd.UPPER, RangeEnd.UPPER)
    assert found.is_end_known == (True,)


def test_tip_is_link_of_io_teleop_before_other_tool_links(tmp_path: Path) -> None:
    text = urdf(("main",), torso=0)
    for link in ("main_tcp", "io_teleop_ee_link_main", "tool0"):
        joint = f'<joint name="to_{link}" type="fixed"><parent link="main_arm_link7"/><child link="{link}"/></joint>'
        text = text.replace("</robot>", f'<link name="{link}"/>{joint}</robot>')
    assert [arm.tip for arm in limbs(tmp_path, text).arms] == ["io_teleop_ee_link_main"]


@pytest.mark.parametrize("sides", [("left", "right"), ("one", "two")])
def test_fingers_of_two_short_limbs_form_no_gripper(tmp_path: Path, sides: tuple[str, str]) -> None:
    """With limbs of three joints the draft has no arm behind the torso, and their fingers form no hand."""
    found = limbs(tmp_path, urdf(sides, arm=3))
    assert [arm.joints for arm in found.arms] == [TORSO]
    assert found.grippers == ()
