"""Matrices (4, 4) that bring points of the world to where OpenGL draws them, and the light's way to look at a scene."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.camera import Camera
from cellwright.util.pose import Vector3

Matrix = NDArray[np.float64]


def of_camera(camera: Camera, aspect: float, near: float, far: float) -> Matrix:
    """What a camera sees, upside down: rows of pixels are then read from the uppermost on.

    Args:
        camera: the camera.
        aspect: width by height.
        near: nearest [m] that is seen.
        far: farthest [m].
    """
    focal = 1 / math.tan(camera.fov / 2)
    clip_T_optical = np.zeros((4, 4))
    clip_T_optical[0, 0], clip_T_optical[1, 1] = focal / aspect, focal  # y of the picture is down, and stays so
    clip_T_optical[2, 2:] = (far + near) / (far - near), -2 * far * near / (far - near)
    clip_T_optical[3, 2] = 1.0
    return clip_T_optical @ _optical_T_world(camera)


def of_sun(direction: Vector3, centre: Vector3, reach: float) -> Matrix:
    """What is seen from far away in a `direction` (of unit length), within `reach` [m] of a point [m]."""
    eye = tuple(np.add(centre, np.multiply(direction, 2 * reach)).tolist())
    up = (0.0, 0.0, 1.0) if abs(direction[2]) < 0.99 else (0.0, 1.0, 0.0)
    camera = Camera(eye, centre, up)
    clip_T_optical = np.diag([1 / reach, 1 / reach, 1 / (2 * reach), 1.0])
    clip_T_optical[2, 3] = -1.0  # from 0 to 4 times the reach
    return clip_T_optical @ _optical_T_world(camera)


def _optical_T_world(camera: Camera) -> Matrix:
    optical_R_world = camera.world_R_optical.T
    matrix = np.eye(4)
    matrix[:3, :3] = optical_R_world
    matrix[:3, 3] = -optical_R_world @ np.array(camera.eye)
    return matrix
