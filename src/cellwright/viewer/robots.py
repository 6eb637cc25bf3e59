"""Pictures of robots: the camera stands where the whole robot is seen, and the light comes from behind it."""

from __future__ import annotations

import math
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.errors import UsageError
from cellwright.pose import Vector3
from cellwright.viewer.camera import Camera
from cellwright.viewer.picture import Progress, save_picture
from cellwright.world.robot import RobotWorld
from cellwright.world.robot_floor import seen_corners

WIDTH, HEIGHT = 900, 1000
"""Of a picture, in pixels, unless told otherwise."""

_FOV = math.radians(30)
_MARGIN = 0.94  # share of the picture that the robot fills
_NEAREST = 0.05  # [m], of a robot that has nothing to be seen
_LAMP_TURN, _LAMP_TILT, _LAMP_DISTANCE = math.radians(28), math.radians(48), 8.0  # [m]


def save_robot_picture(
    path: str | Path,
    world: RobotWorld,
    data: mujoco.MjData,
    width: int = WIDTH,
    height: int = HEIGHT,
    *,
    turn: float = math.radians(-28),
    tilt: float = math.radians(12),
    progress: Progress | None = None,
) -> None:
    """Writes a picture of the whole robot as it stands to the file `path`, as PNG.

    Args:
        path: the file.
        world: the robot.
        data: its state; only read.
        width: in pixels.
        height: in pixels.
        turn: from where it is seen [rad]: 0 from its front (the x axis of its root link), positive from its left.
        tilt: from how far above [rad].
        progress: told how far it is.

    Raises:
        UsageError: if an argument is out of range or the file cannot be written.
    """
    heading = turn + _heading(world, data)
    camera = camera_on(world.model, data, heading, tilt, width, height)
    lamp = _direction(heading - _LAMP_TURN, _LAMP_TILT)
    x, y, z = (float(_LAMP_DISTANCE * value) for value in lamp)
    save_picture(path, world.model, data, camera, width, height, lamp=(x, y, z), progress=progress)


def camera_on(
    model: mujoco.MjModel, data: mujoco.MjData, heading: float, tilt: float, width: int, height: int
) -> Camera:
    """A camera that has all that is seen of a robot in its picture.

    Args:
        model: the robot.
        data: its state; only read.
        heading: from where it looks at the robot [rad], about the world's z from x.
        tilt: from how far above [rad], less than a right angle.
        width: of the picture, in pixels.
        height: of the picture, in pixels.

    Raises:
        UsageError: if an argument is out of range.
    """
    if width < 1 or height < 1:
        raise UsageError(f"a picture has at least one pixel, not {width} x {height}")
    corners = seen_corners(model, data)
    if not len(corners):
        corners = np.zeros((1, 3))
    back = _direction(heading, tilt)
    target = (corners.min(axis=0) + corners.max(axis=0)) / 2
    up = math.tan(_FOV / 2) * _MARGIN
    across = up * width / height
    for _ in range(4):  # the target moves to where the picture's middle is; a few rounds settle it
        optical = (corners - target) @ _camera(target + back, target).world_R_optical
        right, down, deep = optical.T
        distance = max(_NEAREST, float(np.max(np.maximum(np.abs(right) / across, np.abs(down) / up) - deep)))
        sight = _camera(target + distance * back, target)
        slopes = optical[:, :2] / (deep + distance)[:, None]
        shift = distance * (slopes.min(axis=0) + slopes.max(axis=0)) / 2
        target = target + sight.world_R_optical[:, :2] @ shift
    return _camera(target + distance * back, target)


def _camera(eye: NDArray[np.float64], target: NDArray[np.float64]) -> Camera:
    return Camera(_vector(eye), _vector(target), fov=_FOV)


def _heading(world: RobotWorld, data: mujoco.MjData) -> float:
    """Which way the robot faces [rad], about the world's z from x."""
    still = mujoco.MjData(world.model)
    still.qpos[:], still.mocap_pos[:], still.mocap_quat[:] = data.qpos, data.mocap_pos, data.mocap_quat
    mujoco.mj_kinematics(world.model, still)
    x, y = still.body(world.config.robot.root).xmat[[0, 3]]
    return math.atan2(y, x)


def _direction(heading: float, tilt: float) -> NDArray[np.float64]:
    level = math.cos(tilt)
    return np.array([level * math.cos(heading), level * math.sin(heading), math.sin(tilt)])


def _vector(values: NDArray[np.float64]) -> Vector3:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
