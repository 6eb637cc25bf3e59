"""What a camera's view takes in: the space between two planes and four sides."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose, Vector3


class Frustum:
    """A pyramid without its top, along the +x axis of a camera; +y is left and +z is up in its view.

    Args:
        world_T_camera: pose of the camera; the tip of the pyramid is its origin.
        near: distance of the near plane [m].
        far: distance of the far plane [m].
        horizontal_fov: angle between the left and the right side [rad].
        aspect: width of the view over its height.
    """

    def __init__(self, world_T_camera: Pose, *, near: float, far: float, horizontal_fov: float, aspect: float) -> None:
        if not (0.0 < near < far and 0.0 < horizontal_fov < math.pi and aspect > 0.0):
            raise UsageError(f"no view has near {near}, far {far}, fov {horizontal_fov}, aspect {aspect}")
        slope_y = math.tan(horizontal_fov / 2)
        slope_z = slope_y / aspect
        camera_normals = [
            (1.0, 0.0, 0.0),
            (-1.0, 0.0, 0.0),
            _unit((slope_y, 1.0, 0.0)),
            _unit((slope_y, -1.0, 0.0)),
            _unit((slope_z, 0.0, 1.0)),
            _unit((slope_z, 0.0, -1.0)),
        ]
        # a point p is on the inner side of a plane when normal . p >= offset
        self._normals = np.array([world_T_camera.rotate(normal) for normal in camera_normals]).T  # (3, 6)
        self._offsets = np.array([near, -far, 0.0, 0.0, 0.0, 0.0]) + np.array(world_T_camera.position) @ self._normals
        self._spans = np.abs(self._normals)

    def meets(self, centres: NDArray[np.float64], halves: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which boxes the view takes in: those that lie wholly behind none of its six planes.

        This is the test of `gazebo::LogicalCamera`: nothing hides anything, and a box that lies outside across an
        edge of the view, in front of each single plane, counts as seen.

        Args:
            centres: middles of boxes along the world's axes [m], shape (n, 3).
            halves: half their sizes [m], shape (n, 3).

        Returns:
            Shape (n,).
        """
        inside = centres @ self._normals - self._offsets
        reach = halves @ self._spans
        return np.asarray((inside >= -reach).all(axis=1))


def _unit(vector: Vector3) -> Vector3:
    x, y, z = vector
    length = math.hypot(x, y, z)
    return x / length, y / length, z / length
