"""Checks of a whole configuration: the joints that move a link, and groups by their keys."""

from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.groups import groups, moving_joints
from cellwright.config.robot.model import RobotModel, link_poses
from cellwright.config.robot.robots import load_robot
from cellwright.util.pose import Pose
from tests.config.robot.small_robot import INDICES, write


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> RobotConfig:
    return load_robot(write(tmp_path_factory.mktemp("small")), lambda _line: None)


def test_groups_have_keys_of_file(small: RobotConfig) -> None:
    found = {key: (joints, home) for key, joints, home in groups(small)}
    assert list(found) == ["arms[0]", "arms[1]", "grippers[0]", "grippers[1]", "head", "waist", "dorsal"]
    assert found["arms[1]"] == (("l1", "l2"), (-0.1, 0.2))
    assert found["grippers[0]"] == (("r_finger", "r_thumb"), (0.0, -0.04))


def test_movers_exclude_joints_above_fixed_link(small: RobotConfig) -> None:
    assert moving_joints(small.robot, "r_hand", None) == {"lift", "r1", "r2", "r_wrist"}
    assert moving_joints(small.robot, "r_hand", "torso") == {"r1", "r2", "r_wrist"}
    assert moving_joints(small.robot, "base", "torso") == {"lift"}
    assert moving_joints(small.robot, "torso", "torso") == set()


LINKS = st.sampled_from(["base", "torso", "r_upper", "r_hand", "l_lower", "l_jaw", "neck", "head", "wheel"])
JOINTS = st.sampled_from([name for name in INDICES if not name.endswith(("wrist", "thumb", "finger"))])


@given(LINKS, LINKS, JOINTS)
def test_movers_equal_joints_that_move_link_in_kinematics(
    small: RobotConfig, link: str, fixed_link: str, joint: str
) -> None:
    held, turned = (pose_in(small.robot, fixed_link, link, {joint: position}) for position in (0.0, 0.3))
    moved = max(abs(a - b) for a, b in zip(pose_numbers(held), pose_numbers(turned), strict=True)) > 1e-6
    assert moved == (joint in moving_joints(small.robot, link, fixed_link))


def pose_in(robot: RobotModel, fixed_link: str, link: str, positions: dict[str, float]) -> Pose:
    poses = link_poses(robot, positions)
    return poses[fixed_link].inverse() @ poses[link]


def pose_numbers(pose: Pose) -> Iterator[float]:
    yield from pose.position
    yield from pose.quaternion
