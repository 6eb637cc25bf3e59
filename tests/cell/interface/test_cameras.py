"""Cameras in a whole cell: their messages show the scene as it is, and listening changes nothing."""

from __future__ import annotations

import math
from collections import defaultdict
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from cellwright.cell.cell import Cell
from cellwright.cell.interface.rows import camera_rows, rows
from cellwright.config.sensors import PictureCameraConfig
from cellwright.config.trial.gear2017 import load_trial
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.conversions import pose_from_transform
from cellwright.middleware.messages.standard import CameraInfo, Image, PointCloud, PointCloud2
from cellwright.rendering.cameras.picture_camera import PictureCamera
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose
from tests.support.cells import Ear
from tests.support.places import BIN_SURFACE

WIDTH, HEIGHT = 96, 72
QUIET = "noise: {colour: 0, depth: 0, depth_growth: 0}"
CELL = f"""
arm: {{type: ur10}}
options: {{insert_models_over_bins: true, insert_agvs: false}}
models_over_bins:
  bin7:
    models:
      gear_part: {{xyz_start: [0.37, 0.24, 0], xyz_end: [0.37, 0.24, 0], rpy: [0, 0, 0],
        num_models_x: 1, num_models_y: 1}}
cellwright:
  sensors:
    over: {{type: rgbd_camera, pose: {{xyz: [-0.3, 0.23, 1.4], rpy: [0, pi/2, 0]}}, fov: 0.8, rate: 20, {QUIET},
      width: {WIDTH}, height: {HEIGHT}}}
    slanted: {{type: depth_camera, pose: {{xyz: [-0.9, 0.23, 1.2], rpy: [0, 0.7, 0]}}, {QUIET}, rate: 20,
      width: {WIDTH}, height: {HEIGHT}}}
    wrist: {{type: rgb_camera, frame: vacuum_gripper_link, pose: {{xyz: [0.08, 0, 0], rpy: [0, pi/2, 0]}}, rate: 20,
      width: {WIDTH}, height: {HEIGHT}}}
"""
TOPICS = {
    "/ariac/over/image_raw": "sensor_msgs/Image",
    "/ariac/over/camera_info": "sensor_msgs/CameraInfo",
    "/ariac/over/depth/image_raw": "sensor_msgs/Image",
    "/ariac/over/depth/camera_info": "sensor_msgs/CameraInfo",
    "/ariac/over/depth/points": "sensor_msgs/PointCloud2",
    "/ariac/slanted/depth/image_raw": "sensor_msgs/Image",
    "/ariac/slanted/depth/camera_info": "sensor_msgs/CameraInfo",
    "/ariac/slanted/depth/points": "sensor_msgs/PointCloud2",
    "/ariac/slanted": "sensor_msgs/PointCloud",
    "/ariac/wrist/image_raw": "sensor_msgs/Image",
    "/ariac/wrist/camera_info": "sensor_msgs/CameraInfo",
}


def new_cell() -> Cell:
    return Cell(load_trial(text=CELL).trial)


@pytest.fixture(scope="module")
def shown() -> tuple[Cell, dict[str, list[Any]]]:
    """A cell after two pictures of each camera, and the messages of each topic."""
    cell, messages = new_cell(), defaultdict[str, list[Any]](list)
    for topic in (*TOPICS, "/tf_static"):
        cell.bus.subscribe(topic, messages[topic].append)
    cell.simulation.step_until(152_000_000)
    cell.simulation.refresh()
    return cell, dict(messages)


def depths(message: Image) -> NDArray[np.float32]:
    return message.data.view(np.float32).reshape(message.height, message.width)


def cloud(message: PointCloud2, columns: int) -> NDArray[np.float32]:
    return message.data.view(np.float32).reshape(message.height, message.width, columns)


def in_world(points: NDArray[Any], world_T_points: Pose) -> NDArray[np.float64]:
    return np.array([world_T_points.transform(tuple(point)) for point in points.astype(float).tolist()])


def world_T_optical(messages: dict[str, list[Any]], name: str) -> Pose:
    frames = {each.child_frame_id: each for each in messages["/tf_static"][0].transforms}
    camera, optical = frames[f"{name}_frame"], frames[f"{name}_optical_frame"]
    assert (camera.header.frame_id, optical.header.frame_id) == ("world", f"{name}_frame")
    return pose_from_transform(camera.transform) @ pose_from_transform(optical.transform)


def test_camera_types_publish_their_topics(shown: tuple[Cell, dict[str, list[Any]]]) -> None:
    cell, messages = shown
    types = {topic.name: topic.type for topic in cell.bus.topics()}
    assert {name: types[name] for name in TOPICS} == TOPICS
    for name in TOPICS:
        assert len(messages[name]) == 2, name
        assert [message.header.stamp.nanosec for message in messages[name]] == [50_000_000, 100_000_000], name
        frame = "slanted_frame" if name == "/ariac/slanted" else f"{name.split('/')[2]}_optical_frame"
        assert messages[name][0].header.frame_id == frame


def test_camera_rows_have_rate_of_camera() -> None:
    trial = load_trial(text=CELL.replace("rate: 20", "rate: 7.5")).trial
    camera = next(each for each in trial.sensors if isinstance(each, PictureCameraConfig))
    assert {row.rate_text for row in camera_rows(trial, camera)} == {"7.5 Hz"}
    assert set(camera_rows(trial, camera)) < set(rows(trial, competition=True))


def test_camera_name_that_clashes_with_topic_is_refused() -> None:
    own = "sensors: {eye: {type: depth_camera, pose: {}}}"
    beam = "sensors: {eye/depth/points: {type: break_beam, pose: {}}}"
    with pytest.raises(UsageError, match=r"depth/points already has type .* \(got sensor_msgs/PointCloud2\)"):
        Cell(load_trial(text=f"{beam}\ncellwright: {{{own}}}").trial)


def test_part_is_at_pixels_of_camera_matrix(shown: tuple[Cell, dict[str, list[Any]]]) -> None:
    cell, messages = shown
    picture, info = messages["/ariac/over/image_raw"][-1], messages["/ariac/over/camera_info"][-1]
    assert (picture.encoding, picture.step, info.distortion_model) == ("rgb8", 3 * WIDTH, "plumb_bob")
    colours = picture.data.reshape(HEIGHT, WIDTH, 3).astype(int)
    is_gear = (colours[..., 0] - colours[..., 2]) > 60  # only the gear is yellow
    found_rows, found_columns = np.nonzero(is_gear)
    part = next(each for each in cell.parts.all if each.name.startswith("bin7|gear_part"))
    x, y, z = cell.simulation.data.xpos[part.body]
    rim = [(x + 0.0392 * math.cos(a), y + 0.0392 * math.sin(a), z + 0.012) for a in np.linspace(0, 2 * math.pi, 60)]
    optical = in_world(np.array(rim), world_T_optical(messages, "over").inverse())
    projected = info.k.reshape(3, 3) @ (optical / optical[:, 2:]).T
    for found, expected in ((found_columns, projected[0]), (found_rows, projected[1])):
        assert found.min() == pytest.approx(expected.min(), abs=1.6)
        assert found.max() == pytest.approx(expected.max(), abs=1.6)


def test_depth_agrees_with_geometry(shown: tuple[Cell, dict[str, list[Any]]]) -> None:
    _, messages = shown
    message = messages["/ariac/over/depth/image_raw"][-1]
    assert (message.encoding, message.step) == ("32FC1", 4 * WIDTH)
    depth = depths(message)
    floor = depth[HEIGHT // 2, WIDTH // 2 - 12]  # beside the gear
    assert floor == pytest.approx(1.4 - BIN_SURFACE, abs=0.001)


def test_points_lie_on_surfaces(shown: tuple[Cell, dict[str, list[Any]]]) -> None:
    _, messages = shown
    points = cloud(messages["/ariac/slanted/depth/points"][-1], 3).reshape(-1, 3)
    world = in_world(points[np.isfinite(points[:, 2])], world_T_optical(messages, "slanted"))
    in_the_bin = (np.abs(world[:, 0] + 0.3) < 0.2) & (np.abs(world[:, 1] - 0.23) < 0.2)
    beside_the_gear = in_the_bin & (np.hypot(world[:, 0] + 0.23, world[:, 1] - 0.17) > 0.06)
    assert beside_the_gear.sum() > 200
    np.testing.assert_allclose(world[beside_the_gear, 2], BIN_SURFACE, atol=0.001)


def test_point_cloud_of_2018_has_same_points(shown: tuple[Cell, dict[str, list[Any]]]) -> None:
    _, messages = shown
    points = cloud(messages["/ariac/slanted/depth/points"][-1], 3).reshape(-1, 3)
    points = points[np.isfinite(points[:, 2])]
    found = np.array([(each.x, each.y, each.z) for each in messages["/ariac/slanted"][-1].points])
    np.testing.assert_allclose(found, np.column_stack([points[:, 2], -points[:, 0], -points[:, 1]]), atol=1e-6)


def test_points_have_colours_of_their_pixels(shown: tuple[Cell, dict[str, list[Any]]]) -> None:
    _, messages = shown
    message = messages["/ariac/over/depth/points"][-1]
    assert [(each.name, each.offset, each.datatype) for each in message.fields] == [
        ("x", 0, 7),
        ("y", 4, 7),
        ("z", 8, 7),
        ("rgb", 12, 7),
    ]
    packed = message.data.view(np.uint32).reshape(HEIGHT, WIDTH, 4)[..., 3]
    colours = np.stack([packed >> 16 & 255, packed >> 8 & 255, packed & 255], axis=2)
    picture = messages["/ariac/over/image_raw"][-1].data.reshape(HEIGHT, WIDTH, 3)
    np.testing.assert_array_equal(colours, picture)


def test_camera_on_arm_moves_with_arm(shown: tuple[Cell, dict[str, list[Any]]]) -> None:
    cell, messages = shown
    frames = {each.child_frame_id: each for each in messages["/tf_static"][0].transforms}
    assert frames["wrist_frame"].header.frame_id == "vacuum_gripper_link"
    camera = cell.sensors["wrist"]
    assert isinstance(camera, PictureCamera)
    tool = cell.simulation.data.body("vacuum_gripper_link")
    assert camera.world_T_camera.rotate((1.0, 0.0, 0.0)) == pytest.approx(-tool.xmat.reshape(3, 3)[:, 2], abs=1e-6)


def test_camera_messages_survive_cdr_and_ros1_round_trip(shown: tuple[Cell, dict[str, list[Any]]]) -> None:
    _, messages = shown
    for topic, kind in (
        ("/ariac/over/image_raw", Image),
        ("/ariac/over/camera_info", CameraInfo),
        ("/ariac/over/depth/points", PointCloud2),
        ("/ariac/slanted", PointCloud),
    ):
        message = messages[topic][0]
        assert TYPES.to_cdr(TYPES.from_cdr(TYPES.to_cdr(message), kind)) == TYPES.to_cdr(message)
        assert TYPES.to_ros1(TYPES.from_ros1(TYPES.to_ros1(message), kind)) == TYPES.to_ros1(message)


@pytest.mark.slow
def test_subscribing_to_cameras_changes_no_state_hash() -> None:
    hashes = []
    for listens in (False, True):
        cell = new_cell()
        for topic in TOPICS if listens else ():
            cell.bus.subscribe(topic, lambda _: None)
        cell.simulation.step_until(130_000_000)
        hashes.append(cell.state_hash())
        cell.simulation.close()
    assert hashes[0] == hashes[1]


@pytest.mark.slow
@pytest.mark.parametrize("topic", ["/ariac/over/image_raw", "/ariac/over/depth/points"])
def test_late_subscriber_gets_same_pictures_as_others(topic: str) -> None:
    """A picture comes a period after it was taken; a later subscriber does not get one taken before."""
    found = []
    for listens in (False, True):
        cell = new_cell()
        for other in TOPICS if listens else ():
            cell.bus.subscribe(other, lambda _: None)
        cell.simulation.step_until(70_000_000)
        late = Ear(cell, topic)
        cell.simulation.step_until(210_000_000)
        found.append((late.times, [TYPES.to_cdr(message) for message in late.messages]))
        cell.simulation.close()
    assert found[0][0] == [0.15, 0.2]
    assert found[0] == found[1]


def test_picture_camera_costs_as_much_as_other_sensor() -> None:
    from cellwright.cell.kitting.scorer import system_cost

    assert system_cost(load_trial(text=CELL).trial.sensors) == 300.0
