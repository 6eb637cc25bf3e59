"""The frame tree as published on /tf and /tf_static, compared with independent figures."""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.config.sensors import SensorConfig
from cellwright.middleware.messages.conversions import joint_state, pose_from_transform
from cellwright.util.pose import Pose, normalized
from tests.cell.robot_cells import BESIDE_ARM, tandem_cell
from tests.conftest import DATA
from tests.support.cells import ARM_ONLY, BARE, WHOLE, Ear, run, run_to

FK = json.loads((DATA / "ur10_rail_fk.json").read_text())["cases"]
HALF_TURN = 3.14159

# child: parent, position, yaw (None: not checked here)
STATIC: dict[str, tuple[str, tuple[float, float, float], float | None]] = {
    "bin1_frame": ("world", (-1.0, -1.33, 0.72), 1.5708),
    "bin2_frame": ("world", (-1.0, -0.535, 0.72), 1.5708),
    "bin3_frame": ("world", (-1.0, 0.23, 0.72), 1.5708),
    "bin4_frame": ("world", (-1.0, 0.995, 0.72), 1.5708),
    "bin5_frame": ("world", (-0.3, -1.33, 0.72), 1.5708),
    "bin6_frame": ("world", (-0.3, -0.535, 0.72), 1.5708),
    "bin7_frame": ("world", (-0.3, 0.23, 0.72), 1.5708),
    "bin8_frame": ("world", (-0.3, 0.995, 0.72), 1.5708),
    "agv1_load_point_frame": ("world", (0.3, 3.3, 0.75), HALF_TURN),
    "agv2_load_point_frame": ("world", (0.3, -3.3, 0.75), 0.0),
    "belt_frame": ("world", (1.24, 0.15, 0.91), None),
    "break_beam_1_frame": ("world", (1.6, 2.25, 0.91), HALF_TURN),
    "proximity_sensor_1_frame": ("world", (0.95, 2.6, 0.92), 0.0),
    "laser_profiler_1_frame": ("world", (1.21, 4.0, 1.64), None),
    "linear_arm_actuator": ("world", (0.3, 0.0, 0.9), 0.0),
    "base": ("base_link", (0.0, 0.0, 0.0), HALF_TURN),
    "ee_link": ("wrist_3_link", (0.0, 0.0922, 0.0), math.pi / 2),
    "tool0": ("wrist_3_link", (0.0, 0.0922, 0.0), None),
    "vacuum_gripper_link": ("wrist_3_link", (0.0, 0.1, 0.0), None),
}
LINKS = (
    "linear_arm_actuator",
    "base_link",
    "shoulder_link",
    "upper_arm_link",
    "forearm_link",
    "wrist_1_link",
    "wrist_2_link",
    "wrist_3_link",
)
Tree = dict[str, tuple[str, Pose]]


def tree_of(ear: Ear) -> Tree:
    """Return parent and relative pose of every frame received; a frame has one parent."""
    tree: Tree = {}
    for message in ear.messages:
        for transform in message.transforms:
            child, parent = transform.child_frame_id, transform.header.frame_id
            assert tree.get(child, (parent,))[0] == parent, child
            tree[child] = (parent, pose_from_transform(transform.transform))
    return tree


def in_world(tree: Tree, frame: str) -> Pose:
    """Return world_T_frame."""
    pose = Pose()
    while frame != "world":
        frame, parent_T_frame = tree[frame]
        pose = parent_T_frame @ pose
    return pose


def frame_tree(cell: Cell, seconds: float = 0.2) -> Tree:
    ear = Ear(cell, "/tf", "/tf_static")
    run(cell, seconds)
    return tree_of(ear)


def same_angle(a: float, b: float) -> bool:
    return abs(math.remainder(a - b, 2 * math.pi)) < 1e-3


def test_static_frames_of_whole_cell_are_as_listed() -> None:
    ear = Ear(Cell(WHOLE), "/tf_static")
    assert len(ear) == 1
    tree = tree_of(ear)
    assert tree.keys() == STATIC.keys()
    for child, (parent, position, yaw) in STATIC.items():
        assert tree[child][0] == parent
        assert tree[child][1].position == pytest.approx(position, abs=1e-9), child
        assert yaw is None or same_angle(tree[child][1].yaw, yaw), child


def test_static_frames_of_bare_cell_are_bins_agvs_and_belt() -> None:
    cell = Cell(BARE)
    named = {"bin", "agv", "bel"}
    assert {name[:3] for name in tree_of(Ear(cell, "/tf_static"))} == named
    run(cell, 0.2)
    assert len(Ear(cell, "/tf_static")) == 1


def test_static_sensor_frames_are_named_as_in_original() -> None:
    sensors = (
        SensorConfig("my_camera", "logical_camera", Pose((0.0, 0.0, 1.0))),
        SensorConfig("logical_camera_beam", "break_beam", Pose((0.0, 0.0, 1.0))),
    )
    tree = tree_of(Ear(Cell(replace(BARE, sensors=sensors)), "/tf_static"))
    assert "my_camera_frame" in tree
    assert "logical_camera_beam_frame" not in tree


def test_every_frame_is_connected_to_world() -> None:
    cell = Cell(WHOLE)
    tree = frame_tree(cell)
    for frame in tree:
        assert in_world(tree, frame).is_finite()
    for parent, child in itertools.pairwise(LINKS):
        assert tree[child][0] == parent
    cameras = ("logical_camera_1", "logical_camera_2", "quality_control_sensor_1", "quality_control_sensor_2")
    assert all(tree[f"{camera}_frame"][0] == "world" for camera in cameras)
    assert in_world(tree, "logical_camera_2_frame").position == pytest.approx((0.3, 3.15, 1.5))
    seen = {child: parent for child, (parent, _) in tree.items() if "camera" in child and child not in STATIC}
    assert seen == {
        "logical_camera_1_frame": "world",
        "logical_camera_1_piston_rod_part_5_frame": "logical_camera_1_frame",
        "logical_camera_2_frame": "world",
        "logical_camera_2_agv1_frame": "logical_camera_2_frame",
        "logical_camera_2_kit_tray_1_frame": "logical_camera_2_agv1_frame",
        "logical_camera_2_gear_part_1_frame": "logical_camera_2_frame",
        "logical_camera_2_gear_part_2_frame": "logical_camera_2_frame",
    }
    assert "quality_control_sensor_1_gear_part_2_frame" in tree
    assert "quality_control_sensor_1_gear_part_1_frame" not in tree


def test_detected_models_have_frames_at_their_poses() -> None:
    """The original's own test of its frames, to the same tolerance of 0.05 m, and tighter."""
    cell = Cell(WHOLE)
    tree = frame_tree(cell)
    assert in_world(tree, "logical_camera_2_agv1_frame").position == pytest.approx((0.3, 3.3, 0.0), abs=1e-3)
    assert in_world(tree, "logical_camera_2_kit_tray_1_frame").position == pytest.approx((0.3, 3.15, 0.75), abs=0.01)
    part = cell.parts.pose(cell.parts.part("tray1|gear_part_1"))
    assert in_world(tree, "logical_camera_2_gear_part_1_frame").position == pytest.approx(part.position, abs=0.005)


def test_detected_belt_part_has_frame() -> None:
    cell = Cell(WHOLE)
    cell.parts.appear("populate_conveyor|gear_part_clone_0", Pose((-0.3, 0.3, 0.73)))
    assert "logical_camera_1_gear_part_clone_0_frame" in frame_tree(cell)


def test_arm_frames_have_stamps_at_50_hz_and_one_publisher() -> None:
    cell = Cell(ARM_ONLY)
    ear = Ear(cell, "/tf")
    run(cell, 0.1)
    stamps = [transform.header.stamp.nanosec for message in ear.messages for transform in message.transforms]
    assert stamps == [n * 20_000_000 for n in range(1, 6) for _ in LINKS[1:]]
    assert cell.bus.topic("/tf").publishers == ("/robot_state_publisher",)


def put(cell: Cell, joints: dict[str, float]) -> None:
    """Set the arm's joints just before the next message of the frames."""
    model, data = cell.simulation.model, cell.simulation.data

    def write(_: int) -> None:
        for name, value in joints.items():
            data.qpos[model.joint(name).qposadr[0]] = value
        cell.simulation.touch()
        watch.cancel()

    watch = cell.simulation.watch("put", Fraction(1, 50), write, rank=-1)


def matrix(pose: Pose) -> np.ndarray[Any, np.dtype[np.float64]]:
    columns = [pose.rotate(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    found = np.eye(4)
    found[:3, :3] = np.transpose(columns)
    found[:3, 3] = pose.position
    return found


@pytest.mark.parametrize("case", FK, ids=lambda case: case["name"])
def test_arm_frames_agree_with_ur10_kinematics(case: dict[str, Any]) -> None:
    cell = Cell(ARM_ONLY)
    put(cell, case["joints"])
    tree = frame_tree(cell, 0.02)
    for link in ("wrist_3_link", "vacuum_gripper_link"):
        np.testing.assert_allclose(matrix(in_world(tree, link)), case[link], rtol=0.0, atol=1e-6)


def test_gripper_frame_follows_arm() -> None:
    cell = Cell(ARM_ONLY)
    ear = Ear(cell, "/tf", "/tf_static")
    run_to(cell, 0.5)
    tree = tree_of(ear)
    link = cell.simulation.model.body("vacuum_gripper_link").id
    cell.simulation.refresh()
    gripper = in_world(tree, "vacuum_gripper_link")
    assert gripper.position == pytest.approx(cell.simulation.data.xpos[link], abs=1e-9)
    w, x, y, z = (float(value) for value in cell.simulation.data.xquat[link])
    assert normalized(gripper.quaternion) == pytest.approx((w, x, y, z), abs=1e-9)


@pytest.mark.parametrize("fixed", [None, "torso"])
def test_links_of_a_robot_have_frames_of_its_name_where_the_engine_has_them(fixed: str | None) -> None:
    trial = tandem_cell(BESIDE_ARM)
    config = replace(trial.robot_models["tandem"], fixed_link=fixed)
    cell = Cell(replace(trial, robot_models={"tandem": config}))
    ear = Ear(cell, "/tf")
    cell.bus.publish("/left/joint_cmd", joint_state(["lift", "right_elbow"], [0.1, 1.0], time=0))
    run_to(cell, 0.5)
    tree = tree_of(ear)
    cell.simulation.refresh()
    data = cell.simulation.data
    for link in config.robot.links:
        pose = in_world(tree, f"tandem_{link}")
        assert pose.position == pytest.approx(data.body(f"tandem/{link}").xpos, abs=1e-9), link
    assert "forearm_link" in tree
