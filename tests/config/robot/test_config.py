"""Robot configuration as a value: ends of grippers, and postures of all groups."""

from pathlib import Path

import pytest

from cellwright.config.robot.config import ArmConfig, GripperConfig, Posture, RangeEnd, RobotConfig
from cellwright.config.robot.model import Joint, JointType, Limits, Link, RobotModel
from cellwright.config.robot.robots import load_robot

FINGER = Joint("finger", JointType.PRISMATIC, "palm", "tip", limits=Limits(0.0, 0.04))


@pytest.mark.parametrize(
    ("ends", "expected"), [((), (0.0, 0.04)), ((RangeEnd.LOWER,), (0.0, 0.04)), ((RangeEnd.UPPER,), (0.04, 0.0))]
)
def test_gripper_is_open_at_its_open_end(ends: tuple[RangeEnd, ...], expected: tuple[float, float]) -> None:
    assert GripperConfig(("finger",), ends).open_and_closed(FINGER) == expected


def test_home_holds_the_home_positions_of_all_groups() -> None:
    robot = RobotModel("hand", "palm", {"palm": Link("palm"), "tip": Link("tip")}, (FINGER,))
    lift = Posture(("finger",), (0.02,))
    config = RobotConfig(robot, "hand", Path("a.yml"), Path("a.urdf"), dorsal=lift)
    assert config.home["finger"] == 0.02
    arm = RobotConfig(robot, "hand", Path("a.yml"), Path("a.urdf"), arms=(ArmConfig(("finger",), "tip", (0.01,)),))
    assert arm.home["finger"] == 0.01


def test_hands_are_what_the_last_joints_of_the_arms_carry() -> None:
    found = set(load_robot("tandem", print).hand_links)
    assert {"right_hand", "right_finger_1", "left_finger_2", "left_tip"} <= found
    assert not found & {"torso", "head", "right_forearm"}
