"""Models of arms with their mounts and tools."""

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.layout.arm_models import ArmModel, arm_model, chain_in_engine, home_of, joints_of, moving_links
from cellwright.config.layout.arms import Arm, Mount, Tool, original_mount
from cellwright.config.robot.collision_shapes import CollisionShapes
from cellwright.config.robot.model import Joint, JointType, Limits, Link, RobotModel, link_poses
from cellwright.config.robot.urdf import read_urdf
from cellwright.config.ur10 import INITIAL_POSITIONS, UR10
from cellwright.util.pose import Pose

UR5 = read_urdf(Path(__file__).parents[2] / "data" / "arms" / "ur5.urdf", warn=lambda _line: None)
MODEL = ArmModel(UR5, Pose(), CollisionShapes())
PEDESTAL = Arm("left", Mount("pedestal", Pose((0.0, 0.0, 0.5))), "ur5.urdf", "tool0")


@given(st.tuples(*[st.floats(-3.0, 3.0)] * 6))
def test_links_are_where_the_description_has_them(values: tuple[float, ...]) -> None:
    positions = dict(zip((joint.name for joint in UR5.driven), values, strict=True))
    expected = link_poses(UR5, positions)
    found = link_poses(arm_model(PEDESTAL, MODEL, ""), positions)
    for link, pose in expected.items():
        assert found[link].position == pytest.approx(pose.position, abs=1e-12)


def test_names_in_the_engine_have_the_name_of_the_arm_and_those_of_2017_none() -> None:
    robot = chain_in_engine(PEDESTAL, {"left": MODEL})
    assert all(name.startswith("left/") for name in (*robot.links, *(joint.name for joint in robot.joints)))
    assert [*joints_of(PEDESTAL, {"left": MODEL})] == [joint.name for joint in UR5.driven]
    assert chain_in_engine(Arm("arm", original_mount(Pose())), {}) is UR10


def test_face_of_the_cup_is_before_the_tip_and_looks_out_of_it() -> None:
    robot = arm_model(PEDESTAL, MODEL, "")
    poses = link_poses(robot, {})
    tip_T_cup = poses["tool0"].inverse() @ poses["vacuum_gripper_link"]
    face = tip_T_cup.transform((0.0, 0.0, -0.005))
    assert face == pytest.approx((0.0, 0.0, 0.1), abs=1e-12)
    assert tip_T_cup.rotate((0.0, 0.0, -1.0)) == pytest.approx((0.0, 0.0, 1.0), abs=1e-12)


def test_rail_comes_before_the_joints_of_the_robot() -> None:
    rail = Mount("rail", Pose(), axis="x", range=(-0.5, 2.0), speed=1.5, effort=700.0)
    arm = Arm("arm1", rail, "ur5.urdf", "tool0", Tool("none"))
    joints = joints_of(arm, {"arm1": MODEL})
    assert [*joints] == ["rail_joint", *(joint.name for joint in UR5.driven)]
    assert joints["rail_joint"] == Limits(-0.5, 2.0, 700.0, 1.5)
    robot = arm_model(arm, MODEL, "")
    moved = link_poses(robot, {"rail_joint": 0.7})["base_link"].position
    assert moved == pytest.approx((0.7, 0.0, 0.0))
    assert "vacuum_gripper_link" not in robot.links
    assert moving_links(arm, {"arm1": MODEL})[0] == "arm1/carriage"


def test_root_is_where_its_file_puts_it_on_the_mount() -> None:
    turned = ArmModel(UR5, Pose.from_rpy((0.0, 0.0, 0.2), (0.0, 0.0, math.pi)), CollisionShapes())
    poses = link_poses(arm_model(PEDESTAL, turned, ""), {})
    assert poses["base_link"].position == pytest.approx((0.0, 0.0, 0.2))
    assert poses["base_link"].rotate((1.0, 0.0, 0.0)) == pytest.approx((-1.0, 0.0, 0.0), abs=1e-12)


def test_joints_beside_the_chain_stand_still_at_home() -> None:
    finger = Joint("finger", JointType.PRISMATIC, "tool0", "finger", axis=(0.0, 0.0, 1.0), limits=Limits(0.0, 0.04))
    robot = RobotModel("gripping", UR5.root, {**UR5.links, "finger": Link("finger")}, (*UR5.joints, finger))
    arm = Arm("arm", Mount("floor", Pose()), "ur5.urdf", "tool0", home={"finger": 0.03})
    built = arm_model(arm, ArmModel(robot, Pose(), CollisionShapes()), "")
    assert "finger" not in [joint.name for joint in built.driven]
    assert built.joint("finger").origin.position == pytest.approx((0.0, 0.0, 0.03))


def test_home_is_at_0_or_the_nearest_limit_where_nothing_is_said() -> None:
    arm = Arm("arm", Mount("floor", Pose()), "ur5.urdf", "tool0", home={"a": 0.5})
    joints = {"a": Limits(-1.0, 1.0), "b": Limits(0.2, 1.0), "c": Limits(-1.0, -0.3), "d": Limits()}
    assert home_of(arm, joints) == {"a": 0.5, "b": 0.2, "c": -0.3, "d": 0.0}
    assert home_of(Arm("arm", original_mount(Pose())), {}) == INITIAL_POSITIONS
