"""Open ends of grippers, from their kinematics."""

from pathlib import Path

import pytest

from cellwright.config.robot.config import RangeEnd
from cellwright.config.robot.limbs import find_open_ends
from cellwright.config.robot.robots import load_robot
from cellwright.config.robot.urdf import read_urdf
from tests.config.robot.torso_robot import urdf, write

UPPER, LOWER = RangeEnd.UPPER, RangeEnd.LOWER
PANDA = """\
<robot name="panda_hand">
  <link name="hand"><inertial><mass value="0.73"/><origin xyz="0 0 0.03"/>
    <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="leftfinger"><visual><origin xyz="0 0.01 0.03"/><geometry><box size="0.02 0.02 0.05"/></geometry></visual>
  </link>
  <link name="rightfinger"><visual><origin xyz="0 0.01 0.03"/><geometry><box size="0.02 0.02 0.05"/></geometry></visual>
  </link>
  <joint name="finger1" type="prismatic"><parent link="hand"/><child link="leftfinger"/><origin xyz="0 0 0.058"/>
    <axis xyz="0 1 0"/><limit lower="0" upper="0.04" effort="20" velocity="0.2"/></joint>
  <joint name="finger2" type="prismatic"><parent link="hand"/><child link="rightfinger"/>
    <origin xyz="0 0 0.058" rpy="0 0 3.14159265"/><axis xyz="0 1 0"/>
    <limit lower="0" upper="0.04" effort="20" velocity="0.2"/>MIMIC</joint>
</robot>
"""


def ends(folder: Path, text: str, *names: str) -> tuple[RangeEnd, ...] | None:
    return find_open_ends(read_urdf(write(folder, text), warn=lambda _line: None), names)


@pytest.mark.parametrize(
    ("fingers", "expected"),
    [
        ((("0 1 0", 0.0, 0.04), ("0 -1 0", 0.0, 0.04)), (UPPER, UPPER)),
        ((("0 1 0", 0.0, 0.04), ("0 1 0", -0.04, 0.0)), (UPPER, LOWER)),
        ((("0 1 0", -0.04, 0.0), ("0 -1 0", -0.04, 0.0)), (LOWER, LOWER)),
        ((("0 1 0", -0.02, 0.02), ("0 -1 0", -0.02, 0.02)), None),  # they pass each other
        ((("0 0 1", 0.0, 0.04), ("0 0 -1", 0.0, 0.0401)), (UPPER, UPPER)),
    ],
)
def test_two_fingers_are_open_where_farther_apart(
    tmp_path: Path, fingers: tuple[tuple[str, float, float], ...], expected: tuple[RangeEnd, ...] | None
) -> None:
    assert ends(tmp_path, urdf(fingers=fingers), "left_gripper_joint1", "left_gripper_joint2") == expected


def test_mimic_finger_has_open_end_of_its_leader(tmp_path: Path) -> None:
    alone, follows = PANDA.replace("MIMIC", ""), PANDA.replace("MIMIC", '<mimic joint="finger1"/>')
    assert ends(tmp_path, alone, "finger1", "finger2") == (UPPER, UPPER)
    assert ends(tmp_path, follows, "finger1", "finger2") == (UPPER, UPPER)
    assert ends(tmp_path, follows, "finger1") == (UPPER,)


def test_open_end_follows_from_shapes_not_frames(tmp_path: Path) -> None:
    """Fingers whose frames meet in the palm's middle, and whose shapes are 5 cm outside and close inwards."""
    inwards = PANDA.replace("MIMIC", "").replace('xyz="0 0.01 0.03"', 'xyz="0 0.05 0.03"')
    inwards = inwards.replace('axis xyz="0 1 0"', 'axis xyz="0 -1 0"')
    assert ends(tmp_path, inwards, "finger1", "finger2") == (LOWER, LOWER)


def test_single_finger_is_open_away_from_palm(tmp_path: Path) -> None:
    away = (("0 1 0", 0.0, 0.04),)
    onto = (("0 1 0", -0.04, 0.0),)
    assert ends(tmp_path, urdf(fingers=away), "left_gripper_joint1") == (UPPER,)
    assert ends(tmp_path, urdf(fingers=onto), "left_gripper_joint1") == (LOWER,)
    across = (("0 1 0", -0.02, 0.02),)
    assert ends(tmp_path, urdf(fingers=across), "left_gripper_joint1") is None


def test_open_end_of_multi_finger_hand_is_unknown() -> None:
    robot = load_robot("qinglong", lambda _line: None)
    assert find_open_ends(robot.robot, robot.grippers[0].joints) is None


def test_tandem_gripper_is_open_at_lower_limit() -> None:
    robot = load_robot("tandem", lambda _line: None)
    assert find_open_ends(robot.robot, robot.grippers[0].joints) == (LOWER,) * len(robot.grippers[0].joints)
