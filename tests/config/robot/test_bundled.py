"""Bundled robots, as the reader of URDF files sees them."""

import math
from pathlib import Path

import mujoco
import pytest

import cellwright.config.robot
from cellwright.config.robot.model import JointType, RobotModel, link_poses
from cellwright.config.robot.robots import load_robot
from cellwright.config.robot.urdf import read_urdf
from cellwright.robot.model import build_robot
from tools.qinglong.urdf import figures

CATALOGUE = Path(cellwright.config.robot.__file__).parent / "catalogue"


@pytest.fixture(scope="module")
def qinglong() -> RobotModel:
    return read_without_warning("qinglong")


@pytest.fixture(scope="module")
def tandem() -> RobotModel:
    return read_without_warning("tandem")


def read_without_warning(name: str) -> RobotModel:
    warnings: list[str] = []
    robot = read_urdf(CATALOGUE / name / "urdf" / f"{name}.urdf", warn=warnings.append)
    assert not warnings
    return robot


def test_qinglong_urdf_equals_its_source_figures(qinglong: RobotModel) -> None:
    for found, expected in zip(qinglong.joints, figures().joints, strict=True):
        names = (found.name, found.type, found.parent, found.child)
        assert names == (expected.name, expected.type, expected.parent, expected.child)
        assert found.origin.position == pytest.approx(expected.origin.position, abs=1e-9)
        assert found.origin.quaternion == pytest.approx(expected.origin.quaternion, abs=1e-9)
        if expected.is_driven:
            assert found.axis == pytest.approx(expected.axis, abs=1e-9)
            assert found.limits == expected.limits
    assert qinglong.written == ()  # its joints are in the order of their indices
    for name, link in figures().links.items():
        mass = qinglong.links[name].inertial
        assert (mass is None) == (link.inertial is None)
        if mass is not None and link.inertial is not None:
            assert mass.mass == pytest.approx(link.inertial.mass)
            assert mass.pose.position == pytest.approx(link.inertial.pose.position, abs=1e-9)
            if any(link.inertial.inertia):
                assert mass.inertia == pytest.approx(link.inertial.inertia, rel=1e-6, abs=1e-15)


@pytest.mark.parametrize("name", ["qinglong", "tandem"])
def test_bundled_robot_at_zero_and_home_has_no_contacts(name: str) -> None:
    """Required for --self-collision, which needs a stable start posture, and for motions home."""
    config = load_robot(name, warn=pytest.fail)
    world = build_robot(config, self_collision=True)
    data = mujoco.MjData(world.model)
    for posture in ({}, config.home):
        for joint in config.robot.driven:
            data.joint(joint.name).qpos[0] = posture.get(joint.name, 0.0)
        mujoco.mj_forward(world.model, data)
        touching = [[world.model.body(world.model.geom_bodyid[g]).name for g in c.geom] for c in data.contact]
        assert not touching


def test_tandem_joints_are_in_index_order(tandem: RobotModel) -> None:
    assert tandem.written == ()
    assert tandem.joints[0].name == "lift"
    assert len(tandem.driven) == 19


def test_tandem_arms_mirror_each_other(tandem: RobotModel) -> None:
    bent = {"shoulder_pitch": 0.3, "shoulder_roll": 0.5, "elbow": 1.0, "wrist_pitch": -0.4, "gripper": 0.02}
    turned = {"shoulder_yaw": 0.7, "forearm_roll": 0.9}
    posture = {f"{side}_{name}": value for side in ("right", "left") for name, value in bent.items()}
    posture |= {f"{side}_{name}": sign * v for side, sign in (("right", 1), ("left", -1)) for name, v in turned.items()}
    poses = link_poses(tandem, posture)
    for name in ("upper_arm", "forearm", "hand", "tip"):
        x, y, z = poses[f"right_{name}"].position
        assert poses[f"left_{name}"].position == pytest.approx((x, -y, z), abs=1e-12)
    one, other = poses["right_finger_1"].position, poses["right_finger_2"].position
    assert math.dist(one, other) == pytest.approx(0.1 - 2 * 0.02)


def test_tandem_tip_points_out_of_hand_between_fingers(tandem: RobotModel) -> None:
    poses = link_poses(tandem, {})
    assert poses["left_tip"].rotate((0.0, 0.0, 1.0)) == pytest.approx((0.0, 0.0, -1.0), abs=1e-9)
    middle = [
        (a + b) / 2 for a, b in zip(poses["left_finger_1"].position, poses["left_finger_2"].position, strict=True)
    ]
    assert poses["left_tip"].position[:2] == pytest.approx(middle[:2], abs=1e-9)


def test_tandem_gripper_is_prismatic_with_mimic_finger(tandem: RobotModel) -> None:
    for side in ("right", "left"):
        driven, follower = tandem.joint(f"{side}_gripper"), tandem.joint(f"{side}_gripper_follower")
        assert (driven.type, driven.limits.lower) == (JointType.PRISMATIC, 0.0)
        assert follower.mimic is not None
        assert follower.mimic.joint == driven.name
