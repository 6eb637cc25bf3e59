"""The entry `sensors` of Cellwright's own section: cameras that take pictures. Strict: every slip is an error."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from typing import Any, cast, get_args

from cellwright.config.layout import ARM_FRAMES
from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Entry, Leaf, Node, Table, described, shortened
from cellwright.config.trial import keys
from cellwright.config.trial.sensors import CAMERA_PREFIX, CAMERA_TYPES, SENSOR_TYPES, TAKEN_NAMES
from cellwright.config.trial.trial import Camera, PictureNoise, Sensor, WhenLate
from cellwright.util.errors import did_you_mean

MOST_CAMERAS = 16
"""Most cameras in one cell."""

LARGEST = (1920, 1080)
"""Width and height of the largest pictures [pixels]."""

MOST_DEPTHS = 1_000_000
"""Most pixels of a picture of depth: as a cloud of points it has to go into one message."""

SMALLEST = 8
"""Least width and height [pixels]."""

SLOWEST, FASTEST = 0.1, 100.0
"""Pictures a second [Hz]."""

NARROWEST, WIDEST = 0.01, 2.8
"""How far a camera sees to the left and right together [rad]."""

NEAREST, FARTHEST = 0.02, 100.0
"""Bounds of the depths that a camera measures [m]."""

LONGEST_LATENCY = 10.0
"""[s]"""

STRONGEST = 1.0
"""Largest figure of noise."""

WORLD = "world"

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)
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
    kind = _type(type_node, reader) if type_node else None
    placement = reader.placement(pose_node) if pose_node else None
    values = _values(table, reader, has_arm=has_arm)
    if name is None or not _check_name(entry, name, taken, reader) or kind is None or placement is None:
        return None
    camera = Camera(name, kind, placement.pose, **values)
    _check_together(entry, camera, reader)
    return camera


def _type(node: Node, reader: Reader) -> str | None:
    kind = reader.name(node)
    if kind is None or kind in CAMERA_TYPES:
        return kind
    if kind in SENSOR_TYPES:
        reader.problems.error(node, f"a {kind} stands in the section sensors at the top")
        return None
    suggestion = did_you_mean(kind, CAMERA_TYPES) or f" (known: {', '.join(CAMERA_TYPES)})"
    reader.problems.error(node, f"unknown type of camera {shortened(kind)!r}{suggestion}")
    return None


def _check_name(entry: Entry, name: str, taken: Collection[str], reader: Reader) -> bool:
    """A camera's name becomes topics and frames, in ROS 1 and in ROS 2."""
    if not _NAME.fullmatch(name):
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
    for name, most in zip(("width", "height"), LARGEST, strict=True):
        if (node := table.get(name)) and (size := reader.whole(node)) is not None:
            values[name] = size
            if not SMALLEST <= size <= most:
                reader.problems.error(node, f"must be from {SMALLEST} to {most} pixels, not {size}")
    bounds = {
        "fov": (NARROWEST, WIDEST, "rad"),
        "rate": (SLOWEST, FASTEST, "Hz"),
        "near": (NEAREST, FARTHEST, "m"),
        "far": (NEAREST, FARTHEST, "m"),
        "latency": (0.0, LONGEST_LATENCY, "s"),
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
    found = {name: _between(each, 0.0, STRONGEST, "", reader) for name in keys.NOISE.names if (each := table.get(name))}
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
    if camera.has_depth and camera.width * camera.height > MOST_DEPTHS:
        reader.problems.error(
            entry,
            f"{camera.width} x {camera.height} pixels are {camera.width * camera.height}; "
            f"a camera that measures depth has at most {MOST_DEPTHS}",
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
