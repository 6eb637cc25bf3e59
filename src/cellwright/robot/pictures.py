"""Pictures of robots: the camera shows the whole robot, and the light comes from behind the camera."""

import math
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.mechanism.shapes import kinematics_of, visible_corners
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import Progress, render, save_png
from cellwright.robot.model import RobotWorld, body_of
from cellwright.util.errors import UsageError
from cellwright.util.pose import Vector3

WIDTH, HEIGHT = 900, 1000
"""Default size of a picture [px]."""
TURN, TILT = math.radians(-28), math.radians(12)
"""Default direction of view [rad]: from the right of the robot's front, and from above."""

_FOV = math.radians(30)
_MARGIN = 0.94  # share of the picture that the robot fills
_MIN_DISTANCE = 0.01  # [m], distance from a robot without visible shapes
_LAMP_TURN, _LAMP_TILT, _LAMP_DISTANCE = math.radians(28), math.radians(48), 8.0  # [m]


def save_robot_picture(
    path: str | Path,
    world: RobotWorld,
    data: mujoco.MjData,
    size: tuple[int, int] = (WIDTH, HEIGHT),
    *,
    turn: float = TURN,
    samples: int = 2,
    progress: Progress | None = None,
) -> None:
    """Write a picture of the whole robot in its posture as PNG.

    Args:
        path: the file.
        world: the robot.
        data: its posture; only read.
        size: width and height [px].
        turn: direction of view [rad]; 0 from its front, the x axis of its root link; positive from its left.
        samples: rays along each side of a pixel at the edges of surfaces.
        progress: called with the progress.

    Raises:
        UsageError: an argument is out of range or the file cannot be written.
    """
    camera = camera_on(world.model, data, robot_heading(world, data) + turn, TILT, *size)
    lamp = robot_lamp(camera)
    save_png(path, render(world.model, data, camera, size, lamp=lamp, samples=samples, progress=progress))


def robot_lamp(camera: Camera) -> Vector3:
    """Return the lamp's position [m], relative to the point that the camera looks at: behind the camera."""
    heading = math.atan2(camera.eye[1] - camera.target[1], camera.eye[0] - camera.target[0])
    return _vector(_LAMP_DISTANCE * _direction(heading - _LAMP_TURN, _LAMP_TILT))


def camera_on(
    model: mujoco.MjModel, data: mujoco.MjData, heading: float, tilt: float, width: int, height: int
) -> Camera:
    """Return a camera with all visible shapes of a robot in its picture; `data` is only read.

    It looks from `heading` [rad], about the world's z from x, and `tilt` above [rad], less than a right angle.

    Raises:
        UsageError: an argument is out of range.
    """
    if width < 1 or height < 1:
        raise UsageError(f"width and height must be at least 1 px (got {width} and {height})")
    corners = visible_corners(model, data)
    if not len(corners):
        corners = np.zeros((1, 3))
    back = _direction(heading, tilt)
    optical_R_world = _camera(back, np.zeros(3)).world_R_optical.T
    right, down, deep = optical_R_world @ corners.T
    slope = math.tan(_FOV / 2) * _MARGIN
    # Each corner keeps the eye behind four planes: at the nearest place behind all, the robot fills the picture.
    x, nearest_x = _eye(right, deep, slope * width / height)
    y, nearest_y = _eye(down, deep, slope)
    middle = (float(deep.min()) + float(deep.max())) / 2
    z = min(nearest_x, nearest_y, middle - _MIN_DISTANCE)
    return _camera(np.array((x, y, z)) @ optical_R_world, np.array((x, y, middle)) @ optical_R_world)


def _eye(across: NDArray[np.float64], deep: NDArray[np.float64], slope: float) -> tuple[float, float]:
    """Return the place of an eye that sees all points within `slope` to either side: across, and maximum depth [m]."""
    # An eye at e and depth z sees a point (x, d) if |x - e| <= slope (d - z). The limits on e from both sides meet
    # where z is largest: nearest to the robot.
    low, high = float(np.max(across - slope * deep)), float(np.min(across + slope * deep))
    return (low + high) / 2, (high - low) / (2 * slope)


def _camera(eye: NDArray[np.float64], target: NDArray[np.float64]) -> Camera:
    return Camera(_vector(eye), _vector(target), fov=_FOV)


def robot_heading(world: RobotWorld, data: mujoco.MjData) -> float:
    """Return the heading of the robot [rad], about the world's z from x."""
    x, y = kinematics_of(world.model, data).body(body_of(world.config.robot.root)).xmat[[0, 3]]
    return math.atan2(y, x)


def _direction(heading: float, tilt: float) -> NDArray[np.float64]:
    level = math.cos(tilt)
    return np.array([level * math.cos(heading), level * math.sin(heading), math.sin(tilt)])


def _vector(values: NDArray[np.float64]) -> Vector3:
    x, y, z = (float(value) for value in values)
    return (x, y, z)
