"""Targets from ROS recordings: a ROS 1 bag, or the folder of a ROS 2 bag (SQLite or MCAP)."""

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from cellwright.clients.operators.playback import GRIPPERS, Targets, TargetSample
from cellwright.clients.operators.robot import GRIPPER_COMMAND, JOINT_COMMAND
from cellwright.config.parsing.tree import Place, Problem, shortened
from cellwright.util.errors import CellwrightError, UsageError

COMMANDS = (
    JOINT_COMMAND,
    "/io_teleop/target_joint_from_vr",
    "/io_teleop/target_finger_joints",
    "/io_teleop/joint_cmd_finger_left",
    "/io_teleop/joint_cmd_finger_right",
    GRIPPER_COMMAND,
)
"""Topics of commands that are played back unchanged."""

_MAX_REASON = 300  # of the library's message, which may repeat all that it has read
_TYPE = "sensor_msgs/msg/JointState"


def is_bag(path: Path) -> bool:
    """Return whether a path looks like a ROS recording."""
    return path.suffix.lower() == ".bag" or os.path.isdir(path)


@contextmanager
def opened_bag(path: Path) -> Iterator[AnyReader]:
    """Open a ROS recording, and close it afterwards.

    Raises:
        UsageError: it cannot be read, now or by what is done meanwhile.
    """
    if os.path.exists(path) and not os.path.isfile(path) and not os.path.isdir(path):
        raise UsageError(f"{path}: cannot be read as a bag: not a regular file")
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            yield reader
    except CellwrightError:
        raise
    except Exception as error:  # a damaged file fails anywhere in the library
        reason = shortened(" ".join(str(error).split()) or type(error).__name__, _MAX_REASON)
        raise UsageError(str(Problem(Place(0, str(path), 0), "", f"cannot be read as a bag: {reason}"))) from None


def read_bag(path: Path, topic: str | None = None) -> Targets:
    """Return the targets in a bag: all its commands, or one topic of joint states as targets of joints.

    Raises:
        UsageError: it cannot be read, or has no targets.
    """
    with opened_bag(path) as reader:
        found = {each.topic: each for each in reader.connections if each.msgtype == _TYPE}
        topics = COMMANDS if topic is None else (f"/{topic.lstrip('/')}",)
        # some recorders leave the slash out
        chosen = [each for name, each in found.items() if f"/{name.lstrip('/')}" in topics]
        if not chosen:
            lacking, there = topic or "commands of io_teleop", ", ".join(sorted(found)) or "none"
            raise UsageError(f"{path}: no {lacking} in it; joint states are on: {there}")
        samples = [
            _sample(path, time, f"/{connection.topic.lstrip('/')}", reader.deserialize(data, connection.msgtype))
            for connection, time, data in reader.messages(connections=chosen)
        ]
    if not samples:
        raise UsageError(f"{path}: it holds no messages")
    begin, to = samples[0].time, None if topic is None else JOINT_COMMAND
    return Targets(path, tuple(TargetSample(each.time - begin, to or each.topic, each.values) for each in samples))


def _sample(path: Path, time: int, topic: str, message: Any) -> TargetSample:
    positions = [float(value) for value in message.position]
    names = [str(name) for name in message.name]
    if topic == GRIPPER_COMMAND:  # their names are ignored
        names = [*GRIPPERS, *(f"gripper_{number}" for number in range(2, len(positions)))][: len(positions)]
    if len(names) != len(positions) or not all(map(math.isfinite, positions)):
        raise UsageError(f"{path}: a message on {topic} at {time / 1e9:.3f} s needs a finite position for each name")
    return TargetSample(time / 1e9, topic, dict(zip(names, positions, strict=True)))
