"""The robot description of the cell, compared with figures of the UR10 and the cell's own frames."""

from __future__ import annotations

import json
import math
from collections import Counter
from dataclasses import replace
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.interface.parameters import robot_description
from cellwright.config.sensors import SensorConfig
from cellwright.util.pose import Pose
from tests.cell.interface.test_frames import frame_tree, in_world, matrix
from tests.cell.interface.urdf_chain import joints_of, world_T
from tests.conftest import DATA
from tests.support.cells import ARM_ONLY, BARE, JOINTS, WHOLE
from tests.support.urdfdom import complaints

FK = json.loads((DATA / "ur10_rail_fk.json").read_text())["cases"]
TEXT = robot_description(WHOLE)


@pytest.mark.parametrize("case", FK, ids=lambda case: case["name"])
def test_description_agrees_with_ur10_kinematics(case: dict[str, Any]) -> None:
    for link in ("wrist_3_link", "vacuum_gripper_link"):
        np.testing.assert_allclose(world_T(TEXT, link, case["joints"]), case[link], rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("case", FK, ids=lambda case: case["name"])
def test_description_read_by_mujoco_agrees_with_ur10_kinematics(
    case: dict[str, Any], capfd: pytest.CaptureFixture[str]
) -> None:
    model = mujoco.MjModel.from_xml_string(TEXT)
    data = mujoco.MjData(model)
    for name, value in case["joints"].items():
        data.qpos[model.joint(name).qposadr[0]] = value
    mujoco.mj_kinematics(model, data)
    found = data.body("vacuum_gripper_link")
    expected = np.array(case["vacuum_gripper_link"])
    np.testing.assert_allclose(found.xpos, expected[:3, 3], rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(found.xmat.reshape(3, 3), expected[:3, :3], rtol=0.0, atol=1e-6)
    limits = {model.joint(index).name: model.jnt_range[index].tolist() for index in range(model.njnt)}
    assert limits["linear_arm_actuator_joint"] == [-2.1, 2.1]
    assert model.njnt == 8
    assert model.jnt_limited.all()  # a joint that must not move is no exception


def test_description_has_frames_of_tf_tree() -> None:
    cell = Cell(WHOLE)
    tree = frame_tree(cell)
    cell.simulation.refresh()
    model, data = cell.simulation.model, cell.simulation.data
    at_rest = {name: float(data.qpos[model.joint(name).qposadr[0]]) for name in JOINTS}
    moves = {joint.name for joint in joints_of(TEXT) if joint.kind != "fixed"}
    joints = {joint.child: joint for joint in joints_of(TEXT)}
    cameras = {child for child in tree if "logical_camera" in child or "quality_control" in child}
    assert joints.keys() == tree.keys() - cameras
    assert moves == {*JOINTS, "vacuum_gripper_joint"}
    for child, joint in joints.items():
        assert joint.parent == tree[child][0]
        np.testing.assert_allclose(world_T(TEXT, child, at_rest), matrix(in_world(tree, child)), rtol=0.0, atol=2e-6)


def test_joints_have_limits_and_friction_of_original() -> None:
    turn = 2 * math.pi
    expected = {  # range, effort, velocity, damping, friction
        "linear_arm_actuator_joint": (2.1, 1000, 3, 20, 500),
        "shoulder_pan_joint": (turn, 530, 2.16, 20, 20),
        "shoulder_lift_joint": (turn, 330, 2.16, 20, 0),
        "elbow_joint": (turn, 150, 3.15, 20, 0),
        "wrist_1_joint": (turn, 54, 3.2, 1, 0),
        "wrist_2_joint": (turn, 54, 3.2, 1, 0),
        "wrist_3_joint": (turn, 54, 3.2, 0.5, 0),
        "vacuum_gripper_joint": (1e-6, 0, 0, 0, 0),
    }
    moving = [joint for joint in joints_of(TEXT) if joint.kind != "fixed"]
    assert [joint.name for joint in moving] == [*expected]
    for joint in moving:
        reach, effort, velocity, damping, friction = expected[joint.name]
        assert joint.limit == {"lower": -reach, "upper": reach, "effort": effort, "velocity": velocity}
        assert joint.dynamics == {"damping": damping, "friction": friction}
    assert [joint.kind for joint in moving] == ["prismatic", *["revolute"] * 7]


def test_links_have_masses_of_simulation() -> None:
    cell = Cell(ARM_ONLY)
    robot = ElementTree.fromstring(robot_description(ARM_ONLY))
    masses = {}
    for link in robot.iter("link"):
        if (mass := link.find("inertial/mass")) is not None:
            masses[link.attrib["name"]] = float(mass.attrib["value"])
    assert len(masses) == 8
    assert masses == {name: pytest.approx(cell.simulation.model.body(name).mass[0]) for name in masses}


def test_description_without_arm_has_fixed_frames() -> None:
    joints = joints_of(robot_description(BARE))
    assert {joint.kind for joint in joints} == {"fixed"}
    assert Counter(joint.parent for joint in joints) == {"world": 11}


def test_later_of_two_frames_with_same_name_wins() -> None:
    clash = SensorConfig("belt", "break_beam", Pose((5.0, 0.0, 0.0)))
    joints = joints_of(robot_description(replace(BARE, sensors=(clash,))))
    (frame,) = [joint for joint in joints if joint.child == "belt_frame"]
    assert frame.origin[0, 3] == 5.0


def test_sensor_name_with_markup_is_escaped() -> None:
    odd = SensorConfig('a"<b>&', "break_beam", Pose())
    assert 'a"<b>&_frame' in {joint.child for joint in joints_of(robot_description(replace(BARE, sensors=(odd,))))}


@pytest.mark.urdfdom
@pytest.mark.parametrize("trial", [WHOLE, BARE, ARM_ONLY], ids=lambda trial: trial.name)
def test_check_urdf_accepts_description(trial: Any) -> None:
    assert complaints(robot_description(trial)) == []
