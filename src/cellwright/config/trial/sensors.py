"""The sections `arm` and `sensors`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import get_args

from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Entry, Node, shortened
from cellwright.config.trial.keys import SENSOR
from cellwright.config.trial.other_years import year_of_sensor
from cellwright.config.trial.trial import CameraType, Sensor, SensorType
from cellwright.util.errors import did_you_mean
from cellwright.util.plugins import entry_points as plugins

MOST_SENSORS = 500
"""Most sensors in one cell."""

ARM_TYPES = ("ur10",)
SENSOR_TYPES: tuple[str, ...] = get_args(SensorType)
CAMERA_TYPES: tuple[str, ...] = get_args(CameraType)
CAMERA_PREFIX = "logical_camera"

TAKEN_NAMES = frozenset(
    {
        "agv1/state",
        "agv2/state",
        "arm/command",
        "arm/state",
        "competition_state",
        "current_score",
        "gripper/state",
        "joint_states",
        "orders",
        "population/state",
        "quality_control_sensor_1",
        "quality_control_sensor_2",
        "trays",
    }
)
"""Topics of the cell, which no sensor can be named after."""

_TOPIC = re.compile(r"[A-Za-z0-9_]+(/[A-Za-z0-9_]+)*", re.ASCII)


def read_arm(node: Node, reader: Reader) -> bool:
    """The section `arm`: whether there is one."""
    table = reader.table(node)
    if table is None:
        return False
    for entry in table.entries.values():
        if entry.name == "initial_joint_states":
            reader.problems.warn(entry, "ignored, as the original did; it has an effect under cellwright: arm:")
        elif entry.name != "type":
            reader.problems.warn(entry, f"unknown entry, ignored{did_you_mean(str(entry.name), ('type',))}")
    kind = reader.required(table, "type")
    name = reader.name(kind) if kind else None
    if kind and name is not None and name not in ARM_TYPES:
        suggestion = did_you_mean(name.lower(), ARM_TYPES) or f" (known: {', '.join(ARM_TYPES)})"
        reader.problems.error(kind, f"unknown arm {shortened(name)!r}{suggestion}")
    return True


def read_sensors(node: Node, reader: Reader) -> tuple[Sensor, ...]:
    """The section `sensors`; sensors of unknown types are left out."""
    table = reader.table(node)
    if table and len(table.entries) > MOST_SENSORS:
        reader.problems.error(node, f"{len(table.entries)} sensors; at most {MOST_SENSORS} are read")
        return ()
    brought = plugins.names("sensors") if table else []
    sensors = [_sensor(entry, brought, reader) for entry in table.entries.values()] if table else []
    found = tuple(sensor for sensor in sensors if sensor is not None)
    # A break beam speaks on a second topic, whose name no other sensor can have.
    changes = {f"{sensor.name}_change": sensor.name for sensor in found if sensor.type == "break_beam"}
    for sensor in found:
        if table and sensor.name in changes:
            beam = changes[sensor.name]
            reader.problems.error(table.entries[sensor.name], f"the break beam {beam!r} has a topic of this name")
    return found


def _sensor(entry: Entry, brought: Sequence[str], reader: Reader) -> Sensor | None:
    name = reader.text_key(entry)
    table = reader.table(entry.value)
    if table is None:
        return None
    reader.ignored(table, SENSOR.names)
    type_node, pose_node = reader.required(table, "type"), reader.required(table, "pose")
    sensor_type = reader.name(type_node) if type_node else None
    placement = reader.placement(pose_node) if pose_node else None
    if name is None or type_node is None or sensor_type is None or placement is None:
        return None
    if sensor_type not in SENSOR_TYPES and sensor_type not in brought:
        year = year_of_sensor(sensor_type)
        origin = f" of the {year} format" if year else ""
        known = (*SENSOR_TYPES, *brought)
        suggestion = did_you_mean(sensor_type, known) or f" (known: {', '.join(known)})"
        if sensor_type in CAMERA_TYPES:
            suggestion = "; cameras that take pictures stand under cellwright: sensors:"
        shown = shortened(sensor_type)
        reader.problems.warn(type_node, f"unknown sensor type {shown!r}{origin}, the sensor is left out{suggestion}")
        return None
    _check_name(entry, name, sensor_type, reader)
    return Sensor(name, sensor_type, placement.pose)


def _check_name(entry: Entry, name: str, sensor_type: str, reader: Reader) -> None:
    """A sensor's name becomes a topic and frames, and by its first letters the original told who sends the frame."""
    if not _TOPIC.fullmatch(name):
        reader.problems.error(entry, "a sensor's name becomes a topic: only letters, digits, _ and / between them")
    elif name in TAKEN_NAMES:
        reader.problems.error(entry, f"the cell itself has a topic {name!r}")
    elif name[0].isdigit():
        reader.problems.warn(entry, "begins with a digit, which ROS 2 has no topics for")
    is_camera = sensor_type == "logical_camera"
    if is_camera and not name.startswith(CAMERA_PREFIX):
        message = f"a logical camera whose name does not begin with {CAMERA_PREFIX}: its frame is published twice"
        reader.problems.warn(entry, message)
    elif not is_camera and name.startswith(CAMERA_PREFIX):
        message = f"begins with {CAMERA_PREFIX} and is none: as in the original, it has no frame"
        reader.problems.warn(entry, message)
