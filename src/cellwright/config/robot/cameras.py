"""Cameras of a robot configuration: the entries as written, and the picture cameras derived from them.

The stack's own reader of these entries is not public. Names and figures are its own; the documentation states how
Cellwright interprets the points that they leave open.
"""

import math
import re
from collections.abc import Callable
from typing import Any, TypeVar, cast

from cellwright.config import sensors
from cellwright.config.parsing.reader import Keys, Reader
from cellwright.config.parsing.tree import Items, Leaf, YamlNode, describe, plain, shortened
from cellwright.config.robot.config import CameraConfig, RobotConfig
from cellwright.config.sensors import PictureCameraConfig
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose, Vector3, normalized, quaternion_from_rpy

_FIGURES = (
    "pos_offset",
    "target_offset",
    "quat",
    "height",
    "up_axis",
    "near_val",
    "far_val",
    "img_width",
    "img_height",
)
CAMERAS = Keys({"name": Reader.name}, dict.fromkeys(_FIGURES))
VERTICAL_FOV = math.radians(100)
"""Vertical field of view of the stack's cameras [rad]."""
RATE = 30.0
"""Rate of pictures [Hz] that the stack's monitors request from cameras."""
_AXES: dict[str, Vector3] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
T = TypeVar("T", bound=tuple[float, ...])
_NAME = re.compile(r"[A-Za-z0-9_]+", re.ASCII)
_ALONG = 1e-6


def read_cameras(node: YamlNode, reader: Reader) -> tuple[CameraConfig, ...]:
    """Return the cameras; their use decides which of their figures are mandatory."""
    if not isinstance(node, Items):
        reader.problems.error(node, f"must be a list of cameras (got {describe(node)})")
        return ()
    cameras = [_read_camera(item, reader) for item in node.items]
    return tuple(camera for camera in cameras if camera is not None)


def _read_camera(node: YamlNode, reader: Reader) -> CameraConfig | None:
    table = reader.table(node)
    name_node = reader.required(table, "name") if table else None
    if table is None or name_node is None:
        return None
    reader.ignored(table, CAMERAS.names)
    name = reader.name(name_node)
    figures = [entry.value for entry in table.entries.values() if entry.name in CAMERAS.optional]
    for figure in figures:
        _check_finite(figure, reader)
    return CameraConfig(name, plain(table)) if name is not None else None


def _check_finite(node: YamlNode, reader: Reader) -> None:
    for item in node.items if isinstance(node, Items) else ():
        _check_finite(item, reader)
    if isinstance(node, Leaf) and isinstance(node.value, float) and not math.isfinite(node.value):
        reader.problems.error(node, "must be a finite number")


def picture_cameras(
    config: RobotConfig, report: Callable[[str], None] = lambda _line: None
) -> dict[str, PictureCameraConfig]:
    """Return the picture cameras of a robot, by name; one that cannot be made is reported and left out."""
    found: dict[str, PictureCameraConfig] = {}
    for described in config.cameras:
        try:
            if described.name in found:
                raise UsageError("another camera has this name")
            found[described.name] = picture_camera(config, described)
        except UsageError as error:
            report(f"camera {described.name!r} takes no pictures: {error}")
    return found


def picture_camera(config: RobotConfig, camera: CameraConfig) -> PictureCameraConfig:
    """Return a picture camera for a camera of a configuration; its frame is the link that it is mounted on.

    Raises:
        UsageError: its figures describe no valid camera; the text says why.
    """
    if not _NAME.fullmatch(camera.name):
        raise UsageError("its name becomes a topic; use only letters, digits and _")
    width = _size(camera, "img_width", 640, sensors.MAX_PICTURE_SIZE[0])
    height = _size(camera, "img_height", 480, sensors.MAX_PICTURE_SIZE[1])
    if width * height > sensors.MAX_DEPTH_PIXELS:
        raise UsageError(f"pictures must have at most {sensors.MAX_DEPTH_PIXELS} pixels (got {width} x {height})")
    near, far = _depth(camera, "near_val", 0.1), _depth(camera, "far_val", 10.0)
    if near >= far:
        raise UsageError(f"near_val must be less than far_val (got {near:g} and {far:g} m)")
    fov = 2 * math.atan(math.tan(VERTICAL_FOV / 2) * width / height)
    return PictureCameraConfig(
        camera.name,
        "rgbd_camera",
        _pose(camera),
        frame=_link(config, camera.name),
        width=width,
        height=height,
        fov=min(fov, sensors.MAX_FOV),
        rate=RATE,
        near=near,
        far=far,
    )


def _link(config: RobotConfig, name: str) -> str:
    """Return the link of a camera: the tip of an arm if its name has `hand_eye`, else the head, else the root."""
    if "hand_eye" in name and config.arms:
        is_left = "left" in name and len(config.arms) > 1
        return config.arms[1 if is_left else 0].tip
    if config.head is not None and config.head.joints:
        return config.robot.joint(config.head.joints[-1]).child
    return config.robot.root


def _pose(camera: CameraConfig) -> Pose:
    """Return link_T_camera, which looks along +x with z up."""
    x, y, z, w = _numbers(camera, "quat", (0.0, 0.0, 0.0, 1.0))
    turn = Pose((0.0, 0.0, 0.0), normalized((w, x, y, z)))
    ex, ey, ez = turn.transform(_numbers(camera, "pos_offset", (0.0, 0.0, 0.0)))
    eye = (ex, ey, ez + _number(camera, "height", 0.0))
    ahead = turn.transform((1.0, 0.0, 0.0))
    target = (eye[0] + ahead[0], eye[1] + ahead[1], eye[2] + ahead[2])
    if "target_offset" in camera.values:
        target = turn.transform(_numbers(camera, "target_offset", target))
    return Pose(eye, look_rotation((target[0] - eye[0], target[1] - eye[1], target[2] - eye[2]), _up(camera)))


def look_rotation(forward: Vector3, up: Vector3) -> tuple[float, float, float, float]:
    """Return the rotation (w, x, y, z) that points +x along `forward`, and +z as close to `up` as possible.

    Raises:
        UsageError: there is no such rotation, or no unique one.
    """
    length = math.hypot(*forward)
    if length < _ALONG:
        raise UsageError("the target must differ from the position")
    x, y, z = (value / length for value in forward)
    yaw, pitch = math.atan2(y, x), -math.asin(max(-1.0, min(1.0, z)))
    level = Pose((0.0, 0.0, 0.0), quaternion_from_rpy(0.0, pitch, yaw))
    axes = (level.rotate(_AXES["y"]), level.rotate(_AXES["z"]))
    across, above = (sum(p * q for p, q in zip(up, axis, strict=True)) for axis in axes)
    if math.hypot(across, above) < _ALONG * math.hypot(*up) or not math.hypot(*up):
        raise UsageError("the up axis must not be parallel to the line of sight")
    return quaternion_from_rpy(math.atan2(-across, above), pitch, yaw)


def _up(camera: CameraConfig) -> Vector3:
    value = camera.values.get("up_axis")
    if isinstance(value, str) and value.lower() in _AXES:
        return _AXES[value.lower()]
    if isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= 2:
        return (*_AXES.values(),)[value]
    return _numbers(camera, "up_axis", _AXES["z"])


def _size(camera: CameraConfig, name: str, default: int, maximum: int) -> int:
    value = camera.values.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int) or not sensors.MIN_PICTURE_SIZE <= value <= maximum:
        raise UsageError(
            f"{name} must be a whole number from {sensors.MIN_PICTURE_SIZE} to {maximum} (got {_shown(value)})"
        )
    return value


def _depth(camera: CameraConfig, name: str, default: float) -> float:
    value = _number(camera, name, default)
    if not value > 0.0:
        raise UsageError(f"{name} must be above 0 m (got {value:g})")
    return min(max(value, sensors.MIN_CAMERA_DEPTH), sensors.MAX_CAMERA_DEPTH)


def _number(camera: CameraConfig, name: str, default: float) -> float:
    value = camera.values.get(name, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise UsageError(f"{name} must be a number (got {_shown(value)})")
    return float(value)


def _numbers(camera: CameraConfig, name: str, default: T) -> T:
    value: Any = camera.values.get(name, default)
    is_list = isinstance(value, list | tuple) and len(value) == len(default)
    if not is_list or any(isinstance(each, bool) or not isinstance(each, int | float) for each in value):
        raise UsageError(f"{name} must be a list of {len(default)} numbers (got {_shown(value)})")
    return cast("T", tuple(float(each) for each in value))


def _shown(value: object) -> str:
    return shortened(repr(value), 41)
