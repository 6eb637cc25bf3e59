"""Targets from ROS recordings, which are made here by the library that reads them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

from cellwright.clients.operators.bags import is_bag, read_bag
from cellwright.clients.operators.playback import TargetSample
from cellwright.clients.operators.robot import GRIPPER_COMMAND, JOINT_COMMAND
from cellwright.util.errors import UsageError

TYPE = "sensor_msgs/msg/JointState"
Messages = list[tuple[str, float, list[str], list[float]]]

MESSAGES: Messages = [
    ("/io_teleop/joint_states", 10.0, ["head", "elbow"], [0.5, 0.6]),
    ("/io_teleop/joint_cmd", 10.0, ["head"], [0.1]),
    ("/io_teleop/target_gripper_status", 10.5, ["joint1", "joint1"], [0.0, 1.0]),
    ("/io_teleop/joint_cmd", 11.0, ["elbow", "head"], [0.2, 0.3]),
]


def topics(messages: Messages) -> dict[str, None]:
    return dict.fromkeys(topic for topic, *_ in messages)


def ros1_bag(path: Path, messages: Messages) -> Path:
    store = get_typestore(Stores.ROS1_NOETIC)
    with Ros1Writer(path) as writer:
        connections = {topic: writer.add_connection(topic, TYPE, typestore=store) for topic in topics(messages)}
        for topic, time, names, positions in messages:
            stamp = store.types["builtin_interfaces/msg/Time"](int(time), 0)
            header = store.types["std_msgs/msg/Header"](0, stamp, "")
            message = store.types[TYPE](header, names, np.array(positions), np.zeros(0), np.zeros(0))
            writer.write(connections[topic], int(time * 1e9), store.serialize_ros1(message, TYPE))
    return path


def ros2_bag(path: Path, messages: Messages, storage: StoragePlugin) -> Path:
    store = get_typestore(Stores.ROS2_HUMBLE)
    with Ros2Writer(path, version=9, storage_plugin=storage) as writer:
        connections = {topic: writer.add_connection(topic, TYPE, typestore=store) for topic in topics(messages)}
        for topic, time, names, positions in messages:
            stamp = store.types["builtin_interfaces/msg/Time"](int(time), 0)
            header = store.types["std_msgs/msg/Header"](stamp, "")
            message = store.types[TYPE](header, names, np.array(positions), np.zeros(0), np.zeros(0))
            writer.write(connections[topic], int(time * 1e9), store.serialize_cdr(message, TYPE))
    return path


def make(kind: str, folder: Path, messages: Messages = MESSAGES) -> Path:
    if kind == "ros1":
        return ros1_bag(folder / "session.bag", messages)
    return ros2_bag(folder / "session", messages, StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3)


@pytest.mark.parametrize("kind", ["ros1", "sqlite3", "mcap"])
def test_bag_commands_keep_their_topics(kind: str, tmp_path: Path) -> None:
    path = make(kind, tmp_path)
    assert is_bag(path)
    assert read_bag(path).samples == (
        TargetSample(0.0, JOINT_COMMAND, {"head": 0.1}),
        TargetSample(0.5, GRIPPER_COMMAND, {"gripper_right": 0.0, "gripper_left": 1.0}),
        TargetSample(1.0, JOINT_COMMAND, {"elbow": 0.2, "head": 0.3}),
    )


def test_named_topic_is_read_as_joint_targets(tmp_path: Path) -> None:
    path = make("ros1", tmp_path)
    for name in ("/io_teleop/joint_states", "io_teleop/joint_states"):
        assert read_bag(path, name).samples == (TargetSample(0.0, JOINT_COMMAND, {"head": 0.5, "elbow": 0.6}),)


def test_topic_without_leading_slash_is_read(tmp_path: Path) -> None:
    path = make("mcap", tmp_path, [("io_teleop/joint_cmd", 1.0, ["head"], [0.1])])
    assert read_bag(path).samples == (TargetSample(0.0, JOINT_COMMAND, {"head": 0.1}),)


@pytest.mark.parametrize(
    ("messages", "topic", "reason"),
    [
        (MESSAGES[:1], None, r"no commands of io_teleop in it; joint states are on: /io_teleop/joint_states"),
        (MESSAGES, "/arm", r"no /arm in it; joint states are on: /io_teleop/joint_cmd, "),
        ([("/io_teleop/joint_cmd", 1.0, ["head", "elbow"], [0.1])], None, "needs a finite position for each name"),
        ([("/io_teleop/joint_cmd", 1.0, ["head"], [np.nan])], None, "needs a finite position for each name"),
    ],
)
def test_bag_without_usable_targets_is_refused(
    messages: Messages, topic: str | None, reason: str, tmp_path: Path
) -> None:
    with pytest.raises(UsageError, match=reason):
        read_bag(make("ros1", tmp_path, messages), topic)


@pytest.mark.parametrize("keep", [0, 10, 100, 4200])
def test_damaged_bag_is_refused(keep: int, tmp_path: Path) -> None:
    path = make("ros1", tmp_path)
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(UsageError, match=r"session\.bag: cannot be read as a bag: \w+"):
        read_bag(path)


def test_folder_without_bag_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="cannot be read as a bag"):
        read_bag(tmp_path)
    with pytest.raises(UsageError, match="cannot be read as a bag"):
        read_bag(tmp_path / "none.bag")


def test_endless_bag_is_refused(tmp_path: Path) -> None:
    (tmp_path / "endless.bag").symlink_to("/dev/zero")
    with pytest.raises(UsageError, match="cannot be read as a bag: not a regular file"):
        read_bag(tmp_path / "endless.bag")
