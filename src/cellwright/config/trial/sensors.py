"""Arm, sensors, cameras and plugin devices of a trial."""

import re
from collections.abc import Collection, Sequence
from typing import get_args

from cellwright.config.layout.layout import Layout
from cellwright.config.parsing.reader import Keys, Reader, any_name, number, one_of, section, whole
from cellwright.config.parsing.schema import NAME, accepts, mapping
from cellwright.config.parsing.tree import Entry, Table, YamlNode, plain, shortened
from cellwright.config.sensors import (
    MAX_CAMERA_DEPTH,
    MAX_CAMERA_LATENCY,
    MAX_DEPTH_PIXELS,
    MAX_FOV,
    MAX_PICTURE_RATE,
    MAX_PICTURE_SIZE,
    MIN_CAMERA_DEPTH,
    MIN_FOV,
    MIN_PICTURE_RATE,
    MIN_PICTURE_SIZE,
    PictureCameraConfig,
    PictureNoise,
    SensorConfig,
    WhenLate,
)
from cellwright.config.trial.other_years import LATER_SENSORS
from cellwright.config.trial.trial import PluginDevice
from cellwright.config.trial.values import CAMERA_TYPES, SENSOR_TYPES, read_camera_type
from cellwright.util import plugins as plugins
from cellwright.util.errors import did_you_mean, suggestion

MAX_SENSORS = 500
"""Maximum number of sensors in one cell."""

ARM_TYPES = ("ur10",)
CAMERA_PREFIX = "logical_camera"

_OF_ARMS = ("arm/command", "arm/state", "gripper/state", "joint_states")
RESERVED_NAMES = frozenset({*_OF_ARMS, "competition_state", "current_score", "orders", "trays"})
"""Topics of every cell, which sensors must not be named after."""

SENSOR = Keys({"type": any_name(SENSOR_TYPES), "pose": Reader.pose}, texts="sensors")

_TOPIC = re.compile(r"[A-Za-z0-9_]+(/[A-Za-z0-9_]+)*", re.ASCII)
MAX_CAMERAS = 16
"""Maximum number of cameras in one cell."""
WORLD = "world"
_CAMERA_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)
NOISE = Keys(
    optional=dict.fromkeys(("colour", "depth", "depth_growth"), number(0.0, 1.0)), strict="entry", texts="own-noise"
)
"""Keys of a camera's noise."""
CAMERA = Keys(
    {"type": read_camera_type, "pose": Reader.pose},
    {
        "frame": Reader.name,
        "width": whole(MIN_PICTURE_SIZE, MAX_PICTURE_SIZE[0], "pixels"),
        "height": whole(MIN_PICTURE_SIZE, MAX_PICTURE_SIZE[1], "pixels"),
        "fov": number(MIN_FOV, MAX_FOV, "rad"),
        "rate": number(MIN_PICTURE_RATE, MAX_PICTURE_RATE, "Hz"),
        "near": number(MIN_CAMERA_DEPTH, MAX_CAMERA_DEPTH, "m"),
        "far": number(MIN_CAMERA_DEPTH, MAX_CAMERA_DEPTH, "m"),
        "shadows": Reader.boolean,
        "noise": section(NOISE, PictureNoise),
        "latency": number(0.0, MAX_CAMERA_LATENCY, "s"),
        "when_late": one_of(get_args(WhenLate)),
    },
    "entry",
    "own-sensors",
)
"""Keys of a camera under `sensors` in the section `cellwright`."""


def reserved_names(layout: Layout) -> frozenset[str]:
    """Return the topics of a cell, without `/ariac/`, which sensors must not be named after.

    Example:
        >>> from cellwright.config.layout.gear2017 import gear2017
        >>> sorted(reserved_names(gear2017()) - RESERVED_NAMES)[:3]
        ['agv1/state', 'agv2/state', 'population/state']
    """
    belts = layout.belts
    flows = (f"population_{each.name}" for each in belts) if len(belts) > 1 else ("population",) * len(belts)
    return RESERVED_NAMES.union(
        (f"{each.name}/state" for each in layout.stations),
        (f"quality_control_sensor_{each.number}" for each in layout.carriers),
        (f"{each}/state" for each in flows),
        (f"{arm.namespace}/{topic}" for arm in layout.arms if arm.namespace for topic in _OF_ARMS),
    )


def read_arm(node: YamlNode, reader: Reader) -> bool:
    """Return whether the section `arm` specifies an arm."""
    table = reader.table(node)
    if table is None:
        return False
    for entry in table.entries.values():
        if entry.name == "initial_joint_states":
            message = "ignored, as in the original; move it to cellwright: arm:"
            reader.problems.warn(entry, message, ignored=entry)
        elif entry.name != "type":
            message = f"unknown entry, ignored{did_you_mean(str(entry.name), ('type',))}"
            reader.problems.warn(entry, message, ignored=entry)
    kind = reader.required(table, "type")
    if kind:
        one_of(ARM_TYPES, "arm")(reader, kind)
    return True


def read_sensors(node: YamlNode, reserved: Collection[str], reader: Reader) -> tuple[SensorConfig, ...]:
    """Return the section `sensors` without sensors of unknown types; `reserved` names are refused."""
    table = reader.table(node)
    if table and len(table.entries) > MAX_SENSORS:
        reader.problems.error(node, f"too many sensors (got {len(table.entries)}, at most {MAX_SENSORS})")
        return ()
    from_plugins = plugins.names("sensors") if table else []
    sensors = [_sensor(entry, from_plugins, reserved, reader) for entry in table.entries.values()] if table else []
    found = tuple(sensor for sensor in sensors if sensor is not None)
    if table:
        check_change_topics(table, found, reader)
    return found


def check_change_topics(table: Table, sensors: Sequence[SensorConfig], reader: Reader) -> None:
    """Refuse sensors of a section that are named after the second topic of a break beam; `sensors` are all."""
    changes = {f"{sensor.name}_change": sensor.name for sensor in sensors if sensor.type == "break_beam"}
    for sensor in sensors:
        if sensor.name in changes and sensor.name in table.entries:
            message = f"the break beam {changes[sensor.name]!r} has a topic of this name; choose another"
            reader.problems.error(table.entries[sensor.name], message)


def _sensor(
    entry: Entry, from_plugins: Sequence[str], reserved: Collection[str], reader: Reader
) -> SensorConfig | None:
    name = reader.text_key(entry)
    table = reader.table(entry.value)
    if table is None:
        return None
    values = SENSOR.read(table, reader)
    if name is None or not SENSOR.complete(values):
        return None
    sensor = SensorConfig(name, **values)
    if sensor.type not in SENSOR_TYPES and sensor.type not in from_plugins:
        year = LATER_SENSORS.get(sensor.type)
        origin = f" of the {year} format" if year else ""
        hint = suggestion(sensor.type, (*SENSOR_TYPES, *from_plugins))
        if sensor.type in CAMERA_TYPES:
            hint = "; move picture cameras to cellwright: sensors:"
        message = f"unknown sensor type {shortened(sensor.type)!r}{origin}, the sensor is left out{hint}"
        reader.problems.warn(table.entries["type"].value, message, ignored=table)
        return None
    check_sensor_name(entry, sensor, reserved, reader)
    return sensor


def check_sensor_name(entry: Entry, sensor: SensorConfig, reserved: Collection[str], reader: Reader) -> None:
    """Check a name that becomes a topic and frames; its prefix named the publisher of the frame in the original."""
    name = sensor.name
    if not _TOPIC.fullmatch(name):
        reader.problems.error(
            entry, "a sensor's name becomes a topic; use only letters, digits and _, and / between them"
        )
    elif name in reserved:
        reader.problems.error(entry, f"the cell has a topic {name!r}; choose another name")
    elif name[0].isdigit():
        reader.problems.warn(entry, "begins with a digit, which ROS 2 does not allow in topics")
    is_camera = sensor.type == "logical_camera"
    if is_camera and not name.startswith(CAMERA_PREFIX):
        message = f"the name of a logical camera should begin with {CAMERA_PREFIX}; its frame is published twice"
        reader.problems.warn(entry, message)
    elif not is_camera and name.startswith(CAMERA_PREFIX):
        message = (
            f"only logical cameras should begin with {CAMERA_PREFIX}; as in the original, this sensor has no frame"
        )
        reader.problems.warn(entry, message)


def read_cameras(
    own: YamlNode,
    sensors: Sequence[SensorConfig],
    reserved: Collection[str],
    reader: Reader,
    *,
    frames: Collection[str],
) -> tuple[PictureCameraConfig, ...]:
    """Return the cameras under `sensors` in the section `cellwright`; names of topics and other sensors are refused.

    A camera is fixed to the world, or to one of the `frames` of the cell's arms.
    """
    node = own.get("sensors") if isinstance(own, Table) else None
    table = reader.table(node) if node else None
    if table is None:
        return ()
    if len(table.entries) > MAX_CAMERAS:
        reader.problems.error(table, f"too many cameras (got {len(table.entries)}, at most {MAX_CAMERAS})")
        return ()
    used_names = {sensor.name for sensor in sensors}
    cameras = [_camera(entry, used_names, reserved, reader, frames=frames) for entry in table.entries.values()]
    return tuple(camera for camera in cameras if camera is not None)


def _camera(
    entry: Entry, used_names: Collection[str], reserved: Collection[str], reader: Reader, *, frames: Collection[str]
) -> PictureCameraConfig | None:
    name = reader.text_key(entry)
    table = reader.table(entry.value)
    if table is None:
        return None
    values = CAMERA.read(table, reader)
    if name is None or not _check_camera_name(entry, name, used_names, reserved, reader):
        return None
    if not CAMERA.complete(values):
        return None
    camera = PictureCameraConfig(name, **values)
    if camera.frame not in (WORLD, *frames):
        known = did_you_mean(camera.frame, (WORLD, *frames))
        message = f"no frame {camera.frame!r} in a cell without an arm; write arm: {{type: ur10}}"
        if frames:
            message = f"no arm has a link {camera.frame!r}{known}"
        reader.problems.error(table.entries["frame"].value, message)
    _check_together(entry, camera, reader)
    return camera


def _check_camera_name(
    entry: Entry, name: str, used_names: Collection[str], reserved: Collection[str], reader: Reader
) -> bool:
    """Check a name that becomes topics and frames, in ROS 1 and in ROS 2."""
    if not _CAMERA_NAME.fullmatch(name):
        reason = "a camera's name becomes a topic; use only letters, digits and _, with a letter first"
    elif name in used_names:
        reason = "another sensor has this name; choose another"
    elif name in reserved:
        reason = f"the cell has a topic {name!r}; choose another name"
    elif name.startswith(CAMERA_PREFIX):
        reason = f"names that begin with {CAMERA_PREFIX} are for logical cameras; choose another"
    else:
        return True
    reader.problems.error(entry, reason)
    return False


def _check_together(entry: Entry, camera: PictureCameraConfig, reader: Reader) -> None:
    """Report figures that are valid alone but not together."""
    if camera.near >= camera.far:
        reader.problems.error(entry, f"near must be less than far (got {camera.near:g} and {camera.far:g} m)")
    if camera.has_depth and camera.width * camera.height > MAX_DEPTH_PIXELS:
        reader.problems.error(
            entry,
            f"depth pictures must have at most {MAX_DEPTH_PIXELS} pixels "
            f"(got {camera.width} x {camera.height}, which are {camera.width * camera.height})",
        )


@accepts(mapping({"type": "object", "properties": {"type": NAME}, "required": ["type"]}))
def read_plugin_devices(reader: Reader, node: YamlNode) -> tuple[PluginDevice, ...]:
    """Return the devices of plugins: `{name: {type, …}}`; all other entries are settings of the device."""
    table = reader.table(node)
    known = plugins.names("devices") if table else []
    found = []
    for entry in table.entries.values() if table else ():
        name, body = reader.text_key(entry), reader.table(entry.value)
        type_node = reader.required(body, "type") if body else None
        device_type = reader.name(type_node) if type_node else None
        if name is None or body is None or type_node is None or device_type is None:
            continue
        if device_type not in known:
            message = f"unknown device type {shortened(device_type)!r}{suggestion(device_type, known)}"
            reader.problems.error(type_node, message)
        settings = {str(each.name): plain(each.value) for each in body.entries.values() if each.name != "type"}
        found.append(PluginDevice(name, device_type, settings))
    return tuple(found)
