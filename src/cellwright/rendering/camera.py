"""A camera: where it stands, where it looks, and which ray belongs to which pixel.

A pinhole camera without distortion. Pixel coordinates are (column, row), continuous, with (0, 0) at the upper left
corner of the picture: the centre of the first pixel is (0.5, 0.5). The optical frame has x to the right, y down and z
forward.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cellwright.util.errors import UsageError
from cellwright.util.pose import Vector3


@dataclass(frozen=True, slots=True)
class Camera:
    """A pinhole camera in the world frame.

    Attributes:
        eye: where the camera stands [m].
        target: the point that appears in the middle of the picture [m].
        up: a direction that points upwards in the picture; need not be square to the line of sight.
        fov: vertical opening angle [rad], between 0 and pi.

    Raises:
        UsageError: if a number is not finite, the camera looks at its own eye, `up` is along the line of sight or
            `fov` is out of range.
    """

    eye: Vector3
    target: Vector3
    up: Vector3 = (0.0, 0.0, 1.0)
    fov: float = math.radians(45)

    def __post_init__(self) -> None:
        if not all(math.isfinite(v) for v in (*self.eye, *self.target, *self.up, self.fov)):
            raise UsageError("a camera needs finite numbers")
        if not 0 < self.fov < math.pi:
            raise UsageError(f"the opening angle of a camera lies between 0 and pi rad, not at {self.fov:g}")
        forward = np.subtract(self.target, self.eye)
        if not np.linalg.norm(forward) > 0:
            raise UsageError("a camera cannot look at the point where it stands")
        across = np.cross(forward / np.linalg.norm(forward), self.up)
        if not np.linalg.norm(across) > 1e-9 * np.linalg.norm(self.up):
            raise UsageError("the camera's up direction lies along its line of sight")

    @property
    def world_R_optical(self) -> NDArray[np.float64]:
        """The rotation (3, 3) from the optical frame (x right, y down, z forward) to the world frame."""
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

    def project(self, points: NDArray[np.float64], width: int, height: int) -> NDArray[np.float64]:
        """Where `points` (n, 3) of the world [m] appear: (n, 3) of column, row and depth [m] along the line of sight.

        A point beside the picture has pixel coordinates outside it; one in the camera's plane or behind it has a
        depth of zero or less, and NaN for column and row.
        """
        optical = (points - np.asarray(self.eye)) @ self.world_R_optical
        depth = np.where(optical[:, 2] > 0, optical[:, 2], np.nan)
        slope = 2 * math.tan(self.fov / 2) / height
        column = optical[:, 0] / depth / slope + width / 2
        row = optical[:, 1] / depth / slope + height / 2
        return np.column_stack([column, row, optical[:, 2]])
