"""Cameras of a robot's node: pictures on its topics, for subscribers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cellwright.config.robot.config import CameraConfig
from cellwright.config.robot.robots import load_robot
from cellwright.robot.node import RobotNode

SMALL = {"img_width": 64, "img_height": 48}
BEFORE = {"pos_offset": [2.0, 0.0, 0.3], "target_offset": [0.0, 0.0, 0.0]}
CAMERAS = (
    CameraConfig("first_person", {"name": "first_person", **SMALL, **BEFORE}),
    CameraConfig("hand_eye", {"name": "hand_eye", **SMALL, "up_axis": "x"}),
    CameraConfig("first_person", {"name": "first_person"}),
)
TANDEM = load_robot("tandem", lambda _line: None)
TOPIC = "/io_teleop/camera_first_person"


@pytest.mark.slow
def test_camera_images_carry_stamps_of_node() -> None:
    lines: list[str] = []
    wall = 1_000_000_000_000
    nodes: list[RobotNode] = []

    def stamp() -> int:
        return wall + (nodes[0].simulation.now if nodes else 0)

    node = RobotNode(replace(TANDEM, cameras=CAMERAS), report=lines.append, stamp=stamp)
    nodes.append(node)
    assert lines == [
        "camera 'hand_eye' takes no pictures: the up axis must not be parallel to the line of sight",
        "camera 'first_person' takes no pictures: another camera has this name",
    ]
    topics = {topic.name: topic.type for topic in node.bus.topics() if "camera" in topic.name}
    assert topics == {
        f"{TOPIC}/color": "sensor_msgs/Image",
        f"{TOPIC}/depth": "sensor_msgs/Image",
        f"{TOPIC}/camera_info": "sensor_msgs/CameraInfo",
    }
    received: dict[str, list[Any]] = {name: [] for name in topics}
    for name in topics:
        node.bus.subscribe(name, received[name].append)
    node.simulation.step_until(110_000_000)
    colour, depth, info = (received[f"{TOPIC}/{name}"] for name in ("color", "depth", "camera_info"))
    stamps = [message.header.stamp.sec * 10**9 + message.header.stamp.nanosec - wall for message in colour]
    assert stamps == pytest.approx([33_333_333, 66_666_667], abs=1_000_000_000 // 240)
    assert [message.header.stamp for message in depth] == [message.header.stamp for message in colour]
    far = depth[0].data.view(np.float32).reshape(48, 64)
    assert 1.0 < np.nanmin(far[16:32, 24:40]) < 2.1  # distance to the robot, which is in view
    assert (info[0].width, info[0].height) == (64, 48)
    assert np.ptp(colour[0].data.astype(int)) > 60
    node.close()


@pytest.mark.slow
def test_camera_subscriber_does_not_change_state() -> None:
    hashes = []
    for listens in (False, True):
        node = RobotNode(replace(TANDEM, cameras=CAMERAS[:1]))
        if listens:
            node.bus.subscribe(f"{TOPIC}/depth", lambda _: None)
        node.simulation.step_until(100_000_000)
        hashes.append(node.simulation.state_hash())
        node.close()
    assert hashes[0] == hashes[1]
