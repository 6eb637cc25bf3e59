"""Sensor and contact overlays of a cell and of a robot."""

import json
import math

import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.config.trial.gear2017 import load_trial
from cellwright.rendering.scene.engine import SceneCapture
from cellwright.robot.node import RobotNode
from cellwright.viewer.services import scene
from cellwright.viewer.services.scene import SceneServices, ServedScene
from tests.robot.robots import two_arms
from tests.support.cells import BARE, KITTING, SENSORS, WHOLE


def about(served: Cell | RobotNode) -> tuple[dict[str, object], SceneCapture]:
    capture = SceneCapture.of(served)
    return json.loads(json.dumps(served.scene_metadata(capture.index))), capture


def test_cell_metadata_has_sensors_and_gripper() -> None:
    metadata, capture = about(Cell(WHOLE))
    assert metadata["kind"] == "cell"
    sensors = {each["name"]: each for each in metadata["sensors"]}  # type: ignore[attr-defined]
    assert {name: each["form"] for name, each in sensors.items()} == {
        "break_beam_1": "beam",
        "proximity_sensor_1": "cone",
        "laser_profiler_1": "fan",
        "logical_camera_1": "frustum",
        "logical_camera_2": "frustum",
    }
    assert sensors["break_beam_1"]["position"] == pytest.approx(SENSORS[0].pose.position)
    [[body, place]] = metadata["tools"]  # type: ignore[misc]
    assert capture.scene.bodies[body] == "vacuum_gripper_link"  # type: ignore[has-type]
    assert len(place) == 3  # type: ignore[has-type]


def test_robot_metadata_has_tips_and_bare_cell_metadata_is_empty() -> None:
    metadata, capture = about(RobotNode(two_arms()))
    assert metadata["kind"] == "robot"
    assert [capture.scene.bodies[body] for body, _ in metadata["tools"]] == ["tip_right", "tip_left"]  # type: ignore[attr-defined]
    bare, _ = about(Cell(BARE))
    assert bare == {"kind": "cell", "sensors": [], "tools": []}


def test_sensor_overlay_equals_sensor_readings() -> None:
    cell = Cell(WHOLE)
    for _ in range(50):
        cell.step()
    cell.sensors["break_beam_1"].enabled = False
    found = json.loads(json.dumps(cell.sensor_overlay()))
    assert found["break_beam_1"] is None
    reading = cell.sensors["logical_camera_2"].read()
    assert found["logical_camera_2"]["sees"] == bool(reading.detections)
    assert found["logical_camera_2"]["sees"]
    assert len(found["laser_profiler_1"]["ranges"]) == 50
    near = cell.sensors["proximity_sensor_1"].read().range
    assert found["proximity_sensor_1"]["ranges"] == [pytest.approx(near, abs=1e-4)]
    assert RobotNode(two_arms()).sensor_overlay() == {}


def test_contact_forces_carry_weight_of_parts() -> None:
    cell = Cell(KITTING)
    for _ in range(10):
        cell.step()
    rows = np.array(scene.contact_forces(cell))
    assert 0 < len(rows) <= scene.MAX_CONTACTS
    strengths = np.linalg.norm(rows[:, 3:], axis=1)
    assert (np.diff(strengths) <= 1e-3).all()
    assert all(math.isfinite(value) for value in rows.reshape(-1).tolist())


def test_frame_has_requested_overlays_only_and_state_stays_unchanged() -> None:
    watched, alone = Cell(WHOLE), Cell(WHOLE)
    services = SceneServices(ServedScene(watched))
    assert not {"contacts", "sensors"} & services.frame({"contacts": 1, "sensors": "yes"})[0].keys()
    for _ in range(150):
        watched.step()
        alone.step()
        assert {"contacts", "sensors"} <= services.frame({"contacts": True, "sensors": True})[0].keys()
    assert watched.state_hash() == alone.state_hash()


def test_camera_overlay_has_pose_without_drawing() -> None:
    camera = "{type: rgb_camera, frame: vacuum_gripper_link, pose: {xyz: [0.08, 0, 0]}, fov: 1.0, near: 0.2, far: 9}"
    cell = Cell(load_trial(text=f"arm: {{type: ur10}}\ncellwright: {{sensors: {{wrist: {camera}}}}}").trial)
    metadata, _ = about(cell)
    described = metadata["sensors"][0]  # type: ignore[index]
    assert [described[name] for name in ("form", "angle", "near", "far")] == ["frustum", 0.5, 0.2, 1.0]
    for _ in range(20):
        cell.step()
    cell.simulation.refresh()
    found = json.loads(json.dumps(cell.sensor_overlay()))["wrist"]
    tool = cell.simulation.data.body("vacuum_gripper_link")
    assert found["position"] == pytest.approx((tool.xpos + 0.08 * tool.xmat.reshape(3, 3)[:, 0]).tolist(), abs=1e-3)
    assert cell.render_service._worker is None
