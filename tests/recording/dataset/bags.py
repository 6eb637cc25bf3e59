"""Bags of a robot with the topics of `io_teleop`, in each form that ROS records, for tests of data sets."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

STATES, COMMANDS, APPLIED = (f"/io_teleop/{name}" for name in ("joint_states", "joint_cmd", "applied_joint_cmd"))
GRIPPER_STATES, GRIPPERS = "/io_teleop/gripper_states", "/io_teleop/target_gripper_status"
HEAD = "/io_teleop/camera_head/color"
KINDS = ("ros1", "mcap", "sqlite3", "file")
_JOINTS, _IMAGE, _COMPRESSED = (f"sensor_msgs/msg/{name}" for name in ("JointState", "Image", "CompressedImage"))

Message = tuple[str, float, Any]
"""Topic, time [s], and positions by name, a picture (height, width, 3), or the bytes of a compressed one."""


def bag(folder: Path, messages: Sequence[Message], kind: str = "ros1", encoding: str = "rgb8") -> Path:
    """Write a bag: of ROS 1, a folder of ROS 2 with MCAP or SQLite, or the MCAP file of such a folder alone."""
    is_old = kind == "ros1"
    store = get_typestore(Stores.ROS1_NOETIC if is_old else Stores.ROS2_HUMBLE)
    path = folder / ("session.bag" if is_old else "session")
    plugin = StoragePlugin.SQLITE3 if kind == "sqlite3" else StoragePlugin.MCAP
    with Ros1Writer(path) if is_old else Ros2Writer(path, version=9, storage_plugin=plugin) as writer:
        connections: dict[str, Any] = {}
        for topic, time, value in messages:
            stamp = store.types["builtin_interfaces/msg/Time"](int(time), 0)
            header = store.types["std_msgs/msg/Header"](*([0] if is_old else []), stamp, "")
            name, message = _message(store, header, value, encoding)
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, name, typestore=store)
            data = store.serialize_ros1(message, name) if is_old else store.serialize_cdr(message, name)
            writer.write(connections[topic], round(time * 1e9), data)
    return next(path.glob("*.mcap")) if kind == "file" else path


def _message(store: Any, header: Any, value: Any, encoding: str) -> tuple[str, Any]:
    if isinstance(value, dict):
        positions = np.array([*value.values()], float)
        return _JOINTS, store.types[_JOINTS](header, [*value], positions, np.zeros(0), np.zeros(0))
    if isinstance(value, bytes):
        return _COMPRESSED, store.types[_COMPRESSED](header, "jpeg", np.frombuffer(value, np.uint8))
    height, width, depth = value.shape
    return _IMAGE, store.types[_IMAGE](header, height, width, encoding, 0, width * depth, value.ravel())
