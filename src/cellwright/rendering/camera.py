"""Pinhole cameras: rays through pixels, and geometry of pictures.

Cameras have no distortion. Pixel coordinates are (column, row), continuous, with (0, 0) at the upper left corner of the
picture: the centre of the first pixel is (0.5, 0.5). The optical frame has x to the right, y down and z forward.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose, Vector3

OPTICAL = Pose((0.0, 0.0, 0.0), (0.5, -0.5, 0.5, -0.5))
"""camera_T_optical: from x right, y down, z forward to x forward, y left, z up."""
_PLUMB = 1e-6  # [m] beside the vertical, a metre away from it
_UPWARDS, _AHEAD = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Camera:
    """Pinhole camera in the world frame.

    Attributes:
        eye: position of the camera [m].
        target: point in the middle of the picture [m].
        up: upward direction in the picture; need not be perpendicular to the line of sight.
        fov: vertical opening angle [rad], between 0 and pi.

    Raises:
        UsageError: the numbers make no camera.
    """

    eye: Vector3
    target: Vector3
    up: Vector3 = (0.0, 0.0, 1.0)
    fov: float = math.radians(45)

    def __post_init__(self) -> None:
        if not all(math.isfinite(v) for v in (*self.eye, *self.target, *self.up, self.fov)):
            raise UsageError("camera numbers must be finite")
        if not 0 < self.fov < math.pi:
            raise UsageError(f"camera opening angle must be between 0 and pi rad (got {self.fov:g})")
        forward = np.subtract(self.target, self.eye)
        if not np.linalg.norm(forward) > 0:
            raise UsageError("camera position and target must differ")
        across = np.cross(forward / np.linalg.norm(forward), self.up)
        if not np.linalg.norm(across) > 1e-9 * np.linalg.norm(self.up):
            raise UsageError("camera up direction must not lie along the line of sight")

    @classmethod
    def upright(cls, eye: Vector3, target: Vector3, fov: float) -> Camera:
        """Return a camera with the world's z axis upwards in the picture.

        One that looks straight down or up has the x axis upwards, the direction in which `overview` of 2017 looks.
        """
        is_plumb = math.hypot(target[0] - eye[0], target[1] - eye[1]) <= _PLUMB * abs(target[2] - eye[2])
        return cls(eye, target, _AHEAD if is_plumb else _UPWARDS, fov)

    @property
    def world_R_optical(self) -> NDArray[np.float64]:
        """Rotation matrix (3, 3) from the optical frame (x right, y down, z forward) to the world frame."""
        forward = np.subtract(self.target, self.eye)
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        right = right / np.linalg.norm(right)
        return np.column_stack([right, np.cross(forward, right), forward])

    def directions(self, pixels: NDArray[np.float64], width: int, height: int) -> NDArray[np.float64]:
        """Unit vectors (n, 3), world frame, of the rays through `pixels` (n, 2) of a `width` x `height` picture."""
        slope = 2 * math.tan(self.fov / 2) / height
        optical = np.empty((len(pixels), 3))
        optical[:, 0] = (pixels[:, 0] - width / 2) * slope
        optical[:, 1] = (pixels[:, 1] - height / 2) * slope
        optical[:, 2] = 1.0
        optical /= np.sqrt(np.einsum("ij,ij->i", optical, optical))[:, None]
        # einsum, not @: for so thin a matrix the linear algebra library only wakes its threads
        world: NDArray[np.float64] = np.einsum("ij,kj->ik", optical, self.world_R_optical)
        return world


@dataclass(frozen=True)
class Pinhole:
    """Pinhole camera that looks along the +x axis of its frame, with z up.

    Here the centre of the first pixel is (0, 0), as in OpenCV and ROS, and not (0.5, 0.5) as in `Camera`.

    Its `fov` [rad] is the horizontal opening angle.
    """

    width: int
    height: int
    fov: float

    @property
    def focal_length(self) -> float:
        """Focal length in pixels, which are square."""
        return self.width / 2 / math.tan(self.fov / 2)

    @property
    def centre(self) -> tuple[float, float]:
        """Column and row of the line of sight."""
        return (self.width - 1) / 2, (self.height - 1) / 2

    @property
    def vertical_fov(self) -> float:
        """Vertical opening angle [rad]."""
        return 2 * math.atan(self.height / 2 / self.focal_length)

    def at(self, world_T_camera: Pose) -> Camera:
        """Return the camera to draw with, at a pose."""
        ahead, up = world_T_camera.transform((1.0, 0.0, 0.0)), world_T_camera.rotate((0.0, 0.0, 1.0))
        return Camera(world_T_camera.position, ahead, up, self.vertical_fov)

    @cached_property
    def slopes(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """x/z of each column, shape (width,), and y/z of each row, shape (height,), in the optical frame."""
        column, row = self.centre
        across = (np.arange(self.width) - column) / self.focal_length
        down = (np.arange(self.height) - row) / self.focal_length
        return across.astype(np.float32), down.astype(np.float32)

    def points(self, depth: NDArray[np.float32], out: NDArray[np.float32] | None = None) -> NDArray[np.float32]:
        """Return the points (height, width, 3) [m] in the optical frame for depths (height, width) [m].

        With `out`, of the same shape, the points are stored there.
        """
        across, down = self.slopes
        points = np.empty((*depth.shape, 3), np.float32) if out is None else out
        np.multiply(depth, across, out=points[..., 0])
        np.multiply(depth, down[:, None], out=points[..., 1])
        points[..., 2] = depth
        return points
