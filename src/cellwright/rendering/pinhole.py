"""The geometry of a camera's pictures: its matrix, and the points that depths stand for."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.camera import Camera
from cellwright.util.pose import Pose

OPTICAL = Pose((0.0, 0.0, 0.0), (0.5, -0.5, 0.5, -0.5))
"""camera_T_optical: from x right, y down, z forward to x forward, y left, z up."""


@dataclass(frozen=True)
class Pinhole:
    """A camera without distortion that looks along the +x axis of its frame, with z up.

    Here the centre of the first pixel is (0, 0), as in OpenCV and ROS, and not (0.5, 0.5) as in `Camera`.

    Attributes:
        width, height: size of its pictures [pixels].
        fov: how far it sees to the left and right together [rad].
    """

    width: int
    height: int
    fov: float

    @property
    def focal_length(self) -> float:
        """How many pixels a slope of 1 covers; pixels are square."""
        return self.width / 2 / math.tan(self.fov / 2)

    @property
    def centre(self) -> tuple[float, float]:
        """Column and row that the line of sight goes through."""
        return (self.width - 1) / 2, (self.height - 1) / 2

    @property
    def vertical_fov(self) -> float:
        """How far it sees up and down together [rad]."""
        return 2 * math.atan(self.height / 2 / self.focal_length)

    def at(self, world_T_camera: Pose) -> Camera:
        """The camera to draw with, where this one stands."""
        ahead, up = world_T_camera.transform((1.0, 0.0, 0.0)), world_T_camera.rotate((0.0, 0.0, 1.0))
        return Camera(world_T_camera.position, ahead, up, self.vertical_fov)

    @cached_property
    def slopes(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """x/z of each column, shape (width,), and y/z of each row, shape (height,), in the optical frame."""
        column, row = self.centre
        across = (np.arange(self.width) - column) / self.focal_length
        down = (np.arange(self.height) - row) / self.focal_length
        return across.astype(np.float32), down.astype(np.float32)

    def points(self, depth: NDArray[np.float32]) -> NDArray[np.float32]:
        """The points (height, width, 3) [m] in the optical frame that depths (height, width) [m] stand for."""
        across, down = self.slopes
        points = np.empty((*depth.shape, 3), np.float32)
        np.multiply(depth, across, out=points[..., 0])
        np.multiply(depth, down[:, None], out=points[..., 1])
        points[..., 2] = depth
        return points
