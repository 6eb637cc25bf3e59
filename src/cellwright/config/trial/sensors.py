"""Arm, sensors, cameras and plugin devices of a trial."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from typing import Any, cast, get_args

from cellwright.config.layout import ARM_FRAMES
from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Entry, Items, Leaf, Node, Table, described, shortened
from cellwright.config.trial import keys
from cellwright.config.trial.keys import SENSOR
from cellwright.config.trial.other_years import year_of_sensor
from cellwright.config.trial.trial import Camera, CameraType, PictureNoise, PluginDevice, Sensor, SensorType, WhenLate
from cellwright.util import plugins as plugins
from cellwright.util.errors import did_you_mean

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
    _check_sensor_name(entry, name, sensor_type, reader)
    return Sensor(name, sensor_type, placement.pose)


def _check_sensor_name(entry: Entry, name: str, sensor_type: str, reader: Reader) -> None:
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


MOST_CAMERAS = 16
"""Most cameras in one cell."""

MAX_PICTURE_SIZE = (1920, 1080)
"""Width and height of the largest pictures [pixels]."""

MAX_DEPTH_PIXELS = 1_000_000
"""Most pixels of a picture of depth: as a cloud of points it has to go into one message."""

MIN_PICTURE_SIZE = 8
"""Least width and height [pixels]."""

MIN_PICTURE_RATE, MAX_PICTURE_RATE = 0.1, 100.0
"""Pictures a second [Hz]."""

MIN_FOV, MAX_FOV = 0.01, 2.8
"""How far a camera sees to the left and right together [rad]."""

MIN_CAMERA_DEPTH, MAX_CAMERA_DEPTH = 0.02, 100.0
"""Bounds of the depths that a camera measures [m]."""

MAX_CAMERA_LATENCY = 10.0
"""[s]"""

MAX_NOISE = 1.0
"""Largest figure of noise."""

WORLD = "world"

_CAMERA_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)
_LATE: tuple[str, ...] = get_args(WhenLate)


def read_cameras(own: Node | None, sensors: Sequence[Sensor], reader: Reader, *, has_arm: bool) -> tuple[Camera, ...]:
    """What the section `cellwright` has under `sensors`.

    Args:
        own: the section, if there is one.
        sensors: the sensors of the 2017 format; a camera cannot have the name of one.
        reader: collects what is wrong.
        has_arm: whether there is an arm to fix cameras to.
    """
    node = own.get("sensors") if isinstance(own, Table) else None
    table = reader.table(node) if node else None
    if table is None:
        return ()
    if len(table.entries) > MOST_CAMERAS:
        reader.problems.error(table, f"{len(table.entries)} cameras; at most {MOST_CAMERAS} are read")
        return ()
    taken = {sensor.name for sensor in sensors}
    cameras = [_camera(entry, taken, reader, has_arm=has_arm) for entry in table.entries.values()]
    return tuple(camera for camera in cameras if camera is not None)


def _camera(entry: Entry, taken: Collection[str], reader: Reader, *, has_arm: bool) -> Camera | None:
    name = reader.text_key(entry)
    table = reader.table(entry.value)
    if table is None:
        return None
    _only(table, keys.CAMERA.names, reader)
    type_node, pose_node = reader.required(table, "type"), reader.required(table, "pose")
    kind = _camera_type(type_node, reader) if type_node else None
    placement = reader.placement(pose_node) if pose_node else None
    values = _values(table, reader, has_arm=has_arm)
    if name is None or not _check_camera_name(entry, name, taken, reader) or kind is None or placement is None:
        return None
    camera = Camera(name, kind, placement.pose, **values)
    _check_together(entry, camera, reader)
    return camera


def _camera_type(node: Node, reader: Reader) -> str | None:
    kind = reader.name(node)
    if kind is None or kind in CAMERA_TYPES:
        return kind
    if kind in SENSOR_TYPES:
        reader.problems.error(node, f"a {kind} stands in the section sensors at the top")
        return None
    suggestion = did_you_mean(kind, CAMERA_TYPES) or f" (known: {', '.join(CAMERA_TYPES)})"
    reader.problems.error(node, f"unknown type of camera {shortened(kind)!r}{suggestion}")
    return None


def _check_camera_name(entry: Entry, name: str, taken: Collection[str], reader: Reader) -> bool:
    """A camera's name becomes topics and frames, in ROS 1 and in ROS 2."""
    if not _CAMERA_NAME.fullmatch(name):
        reason = "a camera's name becomes a topic: only letters, digits and _, and a letter first"
    elif name in TAKEN_NAMES or name in taken:
        reason = "there is a sensor of this name" if name in taken else f"the cell itself has a topic {name!r}"
    elif name.startswith(CAMERA_PREFIX):
        reason = f"a name that begins with {CAMERA_PREFIX} is that of a logical camera"
    else:
        return True
    reader.problems.error(entry, reason)
    return False


def _values(table: Table, reader: Reader, *, has_arm: bool) -> dict[str, Any]:
    """What is written of the entries that may be left out, where it makes sense."""
    values: dict[str, Any] = {}
    for name, most in zip(("width", "height"), MAX_PICTURE_SIZE, strict=True):
        if (node := table.get(name)) and (size := reader.whole(node)) is not None:
            values[name] = size
            if not MIN_PICTURE_SIZE <= size <= most:
                reader.problems.error(node, f"must be from {MIN_PICTURE_SIZE} to {most} pixels, not {size}")
    bounds = {
        "fov": (MIN_FOV, MAX_FOV, "rad"),
        "rate": (MIN_PICTURE_RATE, MAX_PICTURE_RATE, "Hz"),
        "near": (MIN_CAMERA_DEPTH, MAX_CAMERA_DEPTH, "m"),
        "far": (MIN_CAMERA_DEPTH, MAX_CAMERA_DEPTH, "m"),
        "latency": (0.0, MAX_CAMERA_LATENCY, "s"),
    }
    for name, (least, largest, unit) in bounds.items():
        if (node := table.get(name)) and (number := _between(node, least, largest, unit, reader)) is not None:
            values[name] = number
    if node := table.get("shadows"):
        if isinstance(node, Leaf) and isinstance(node.value, bool):
            values["shadows"] = node.value
        else:
            reader.problems.error(node, f"must be true or false, not {described(node)}")
    if node := table.get("noise"):
        values["noise"] = _noise(node, reader)
    if (node := table.get("frame")) and (frame := _frame(node, reader, has_arm=has_arm)):
        values["frame"] = frame
    if (node := table.get("when_late")) and (late := _one_of(node, _LATE, reader)):
        values["when_late"] = cast("WhenLate", late)
    return values


def _noise(node: Node, reader: Reader) -> PictureNoise:
    table = reader.table(node)
    if table is None:
        return PictureNoise()
    _only(table, keys.NOISE.names, reader)
    found = {name: _between(each, 0.0, MAX_NOISE, "", reader) for name in keys.NOISE.names if (each := table.get(name))}
    return PictureNoise(**{name: number for name, number in found.items() if number is not None})


def _frame(node: Node, reader: Reader, *, has_arm: bool) -> str | None:
    frame = _one_of(node, (WORLD, *ARM_FRAMES), reader)
    if frame in ARM_FRAMES and not has_arm:
        reader.problems.error(node, f"there is no arm, and so no {frame}; an arm comes with arm: {{type: ur10}}")
        return None
    return frame


def _check_together(entry: Entry, camera: Camera, reader: Reader) -> None:
    """Figures that make sense alone, and not with one another."""
    if camera.near >= camera.far:
        reader.problems.error(entry, f"near, {camera.near:g} m, must be less than far, {camera.far:g} m")
    if camera.has_depth and camera.width * camera.height > MAX_DEPTH_PIXELS:
        reader.problems.error(
            entry,
            f"{camera.width} x {camera.height} pixels are {camera.width * camera.height}; "
            f"a camera that measures depth has at most {MAX_DEPTH_PIXELS}",
        )


def _one_of(node: Node, known: Sequence[str], reader: Reader) -> str | None:
    name = reader.name(node)
    if name is None or name in known:
        return name
    suggestion = did_you_mean(name, known) or f" (known: {', '.join(known)})"
    reader.problems.error(node, f"cannot be {shortened(name)!r}{suggestion}")
    return None


def _between(node: Node, least: float, largest: float, unit: str, reader: Reader) -> float | None:
    number = reader.number(node)
    if number is None or least <= number <= largest:
        return None if number is None else float(number)
    reader.problems.error(node, f"must be from {least:g} to {largest:g} {unit}".rstrip() + f", not {number:g}")
    return None


def _only(table: Table, known: tuple[str, ...], reader: Reader) -> None:
    for entry in table.entries.values():
        if entry.name not in known:
            suggestion = did_you_mean(str(entry.name), known) or f" (known: {', '.join(known)})"
            reader.problems.error(entry, f"unknown entry{suggestion}")


def read_plugin_devices(node: Node | None, reader: Reader) -> tuple[PluginDevice, ...]:
    """What the section `cellwright` has under `devices`: `{name: {type, …}}`; what else is there is for the device."""
    devices = node.get("devices") if isinstance(node, Table) else None
    table = reader.table(devices) if devices else None
    known = plugins.names("devices") if table else []
    found = []
    for entry in table.entries.values() if table else ():
        name, body = reader.text_key(entry), reader.table(entry.value)
        type_node = reader.required(body, "type") if body else None
        device_type = reader.name(type_node) if type_node else None
        if name is None or body is None or type_node is None or device_type is None:
            continue
        if device_type not in known:
            suggestion = did_you_mean(device_type, known) or f" (known: {', '.join(known) or 'none'})"
            reader.problems.error(type_node, f"unknown device type {shortened(device_type)!r}{suggestion}")
        settings = {str(each.name): _plain(each.value) for each in body.entries.values() if each.name != "type"}
        found.append(PluginDevice(name, device_type, settings))
    return tuple(found)


def _plain(node: Node) -> Any:
    """A node as plain data: dicts, lists and scalars."""
    match node:
        case Table():
            return {str(entry.name): _plain(entry.value) for entry in node.entries.values()}
        case Items():
            return [_plain(item) for item in node.items]
        case Leaf():
            return node.value
