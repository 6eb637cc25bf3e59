"""Cameras in Cellwright's own section: valid entries, and errors for all mistakes."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.interface.rows import rows
from cellwright.config.sensors import (
    MAX_PICTURE_RATE,
    MAX_PICTURE_SIZE,
    MIN_PICTURE_RATE,
    PictureCameraConfig,
    PictureNoise,
    SensorConfig,
)
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.sensors import reserved_names
from cellwright.config.trial.trial import BeltPart
from cellwright.middleware.interface.table import EndpointKind
from cellwright.util.errors import DescriptionError
from cellwright.util.pose import Pose

POSE = "pose: {xyz: [1, 2, 3], rpy: [0, pi/2, 0]}"


def cameras(section: str, rest: str = "arm: {type: ur10}") -> tuple[SensorConfig, ...]:
    loaded = load_trial(text=f"{rest}\ncellwright: {{sensors: {section}}}")
    assert loaded.warnings == ()
    return loaded.trial.sensors


def refusal(section: str, rest: str = "arm: {type: ur10}") -> str:
    with pytest.raises(DescriptionError) as error:
        cameras(section, rest)
    return str(error.value)


def test_camera_with_type_and_pose_has_defaults() -> None:
    assert cameras(f"{{eye: {{type: rgb_camera, {POSE}}}}}") == (
        PictureCameraConfig("eye", "rgb_camera", Pose.from_rpy((1.0, 2.0, 3.0), (0.0, math.pi / 2, 0.0))),
    )


def test_camera_with_all_entries_is_read() -> None:
    written = f"""{{wrist: {{type: rgbd_camera, {POSE}, frame: vacuum_gripper_link, width: 320, height: 200, fov: 1.5,
      rate: 2.5, near: 0.05, far: 4, shadows: true, noise: {{colour: 0, depth: 0.002, depth_growth: 0.01}}, latency: 0,
      when_late: drop}}}}"""
    (camera,) = cameras(written)
    assert camera == PictureCameraConfig(
        "wrist",
        "rgbd_camera",
        Pose.from_rpy((1.0, 2.0, 3.0), (0.0, math.pi / 2, 0.0)),
        frame="vacuum_gripper_link",
        width=320,
        height=200,
        fov=1.5,
        rate=2.5,
        near=0.05,
        far=4.0,
        shadows=True,
        noise=PictureNoise(0.0, 0.002, 0.01),
        latency=0.0,
        when_late="drop",
    )


def test_cameras_come_after_2017_sensors() -> None:
    sensors = f"sensors: {{beam: {{type: break_beam, {POSE}}}}}"
    found = cameras(f"{{eye: {{type: depth_camera, {POSE}}}}}", sensors)
    assert [(each.name, type(each)) for each in found] == [("beam", SensorConfig), ("eye", PictureCameraConfig)]


@pytest.mark.parametrize(
    ("kind", "colour", "depth"),
    [("rgb_camera", True, False), ("depth_camera", False, True), ("rgbd_camera", True, True)],
)
def test_camera_type_decides_colour_and_depth(kind: str, colour: bool, depth: bool) -> None:
    (camera,) = cameras(f"{{eye: {{type: {kind}, {POSE}}}}}")
    assert isinstance(camera, PictureCameraConfig)
    assert (camera.has_colour, camera.has_depth) == (colour, depth)


@pytest.mark.parametrize(
    ("entries", "reason"),
    [
        ("type: rgb_camera", "cellwright.sensors.eye: the required entry 'pose' is missing"),
        (POSE, "the required entry 'type' is missing"),
        (f"type: rgb_camra, {POSE}", "unknown camera type 'rgb_camra'; did you mean rgb_camera"),
        (f"type: laser_profiler, {POSE}", "a laser_profiler belongs in the top-level section sensors"),
        (f"type: rgb_camera, {POSE}, hight: 3", "cellwright.sensors.eye.hight: unknown entry; did you mean height"),
        (f"type: rgb_camera, {POSE}, width: 4", "width: must be from 8 to 1920 pixels (got 4)"),
        (f"type: rgb_camera, {POSE}, width: 1.5", "width: must be a whole number"),
        (f"type: rgb_camera, {POSE}, height: 1081", "height: must be from 8 to 1080 pixels (got 1081)"),
        (f"type: rgb_camera, {POSE}, fov: 3.2", "fov: must be from 0.01 to 2.8 rad (got 3.2)"),
        (f"type: rgb_camera, {POSE}, rate: 0", "rate: must be from 0.1 to 100 Hz (got 0)"),
        (f"type: rgb_camera, {POSE}, latency: -1", "latency: must be from 0 to 10 s (got -1)"),
        (f"type: rgb_camera, {POSE}, far: .inf", "far: must be a finite number"),
        (f"type: rgb_camera, {POSE}, near: 2, far: 1", "near must be less than far (got 2 and 1 m)"),
        (f"type: rgb_camera, {POSE}, shadows: 1", "shadows: must be true or false (got the number 1)"),
        (f"type: rgb_camera, {POSE}, noise: 1", "noise: must be a mapping"),
        (f"type: rgb_camera, {POSE}, noise: {{color: 1}}", "noise.color: unknown entry; did you mean colour"),
        (f"type: rgb_camera, {POSE}, noise: {{depth: -1}}", "noise.depth: must be from 0 to 1 (got -1)"),
        (f"type: rgb_camera, {POSE}, when_late: weit", "when_late: unknown value 'weit'; did you mean wait"),
        (
            f"type: rgb_camera, {POSE}, frame: wrist3_link",
            "frame: no arm has a link 'wrist3_link'; did you mean wrist_3_link",
        ),
        (
            f"type: depth_camera, {POSE}, width: 1920, height: 1080",
            "at most 1000000 pixels (got 1920 x 1080, which are 2073600)",
        ),
    ],
)
def test_invalid_camera_is_refused(entries: str, reason: str) -> None:
    assert reason in refusal(f"{{eye: {{{entries}}}}}")


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("2nd", "becomes a topic"),
        ("a/b", "becomes a topic"),
        ("orders", "the cell has a topic 'orders'; choose another name"),
        ("beam", "another sensor has this name"),
        ("logical_camera_9", "names that begin with logical_camera are for logical cameras"),
    ],
)
def test_invalid_camera_name_is_refused(name: str, reason: str) -> None:
    sensors = f"sensors: {{beam: {{type: break_beam, {POSE}}}}}"
    assert reason in refusal(f"{{{name}: {{type: rgb_camera, {POSE}}}}}", sensors)


ARM = "arms: {arm: {mount: {kind: rail, at: [0, 5]}}}"
AGVS = "carriers: {agv3: {at: [0, 3]}, cart: {at: [0, -3]}}, trays: {side: {at: [2, 0]}}"
BELT = "in: {from: [0, 0], to: [0, 2]}"
OWN_CELLS = {
    "2017": "",
    "other AGVs": f"cell: {{{ARM}, {AGVS}}}",
    "a belt": f"cell: {{{ARM}, belts: {{{BELT}}}}}",
    "two belts": f"cell: {{{ARM}, belts: {{{BELT}, out: {{from: [2, 0], to: [2, 2]}}}}}}",
}


@pytest.mark.parametrize("name", OWN_CELLS)
def test_names_of_the_topics_of_a_cell_are_reserved_and_no_others(name: str) -> None:
    trial = load_trial(text=OWN_CELLS[name] or "{}").trial
    parts = tuple(BeltPart(1.0, "gear_part", Pose(), belt=each.name) for each in trial.layout.belts)
    table = rows(replace(trial, has_arm=True, belt_parts=parts), competition=False)
    topics = {each.name.removeprefix("/ariac/") for each in table if each.kind is EndpointKind.TOPIC}
    own = {each for each in topics if not each.startswith("/") and not each.startswith("arm/follow_joint_trajectory")}
    assert reserved_names(trial.layout) | {"trays"} == own | {"trays"}


def test_sensor_is_not_named_after_a_topic_of_the_cell() -> None:
    sensors = f"sensors: {{NAME: {{type: break_beam, {POSE}}}}}"
    cell = f"{OWN_CELLS['other AGVs']}\n{sensors}"
    with pytest.raises(DescriptionError, match="the cell has a topic 'agv3/state'"):
        load_trial(text=cell.replace("NAME", "agv3/state"))
    assert load_trial(text=cell.replace("NAME", "agv1/state")).trial.sensors
    with pytest.raises(DescriptionError, match="the cell has a topic 'quality_control_sensor_3'"):
        load_trial(
            text=f"{OWN_CELLS['other AGVs']}\ncellwright: {{sensors: {{quality_control_sensor_3: "
            f"{{type: rgb_camera, {POSE}}}}}}}"
        )


def test_camera_on_missing_arm_is_refused() -> None:
    section = f"{{eye: {{type: rgb_camera, {POSE}, frame: wrist_3_link}}}}"
    assert "frame: no frame 'wrist_3_link' in a cell without an arm" in refusal(section, "")


def test_too_many_cameras_are_refused() -> None:
    section = ", ".join(f"eye{n}: {{type: rgb_camera, {POSE}}}" for n in range(17))
    assert "too many cameras (got 17, at most 16)" in refusal(f"{{{section}}}")


def test_camera_in_2017_section_is_left_out_with_hint() -> None:
    loaded = load_trial(text=f"sensors: {{eye: {{type: depth_camera, {POSE}}}}}")
    (warning,) = loaded.warnings
    assert "of the 2018 format, the sensor is left out; move picture cameras to" in str(warning)


@given(
    width=st.integers(8, MAX_PICTURE_SIZE[0]),
    height=st.integers(8, MAX_PICTURE_SIZE[1]),
    rate=st.floats(MIN_PICTURE_RATE, MAX_PICTURE_RATE),
)
def test_camera_values_within_bounds_are_read_as_written(width: int, height: int, rate: float) -> None:
    (camera,) = cameras(f"{{eye: {{type: rgb_camera, {POSE}, width: {width}, height: {height}, rate: '{rate!r}'}}}}")
    assert isinstance(camera, PictureCameraConfig)
    assert (camera.width, camera.height, camera.rate) == (width, height, rate)
