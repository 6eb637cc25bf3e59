"""Rays from one point, as range sensors cast them."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.errors import UsageError
from cellwright.pose import Pose, Vector3
from cellwright.simulation.simulation import Simulation

SOLID_GROUPS = (1, 3)
"""Geom groups that stop a ray: what is solid. What is only drawn, such as a sensor's own housing, is in group 2."""

_GROUPS = np.array([group in SOLID_GROUPS for group in range(mujoco.mjNGROUP)], dtype=np.uint8)


def fan(horizontal: NDArray[np.float64], vertical: NDArray[np.float64]) -> list[Vector3]:
    """Unit directions about +x, one for each pair of angles [rad]; horizontal angles run fastest.

    A horizontal angle turns towards +y, a vertical one towards +z.
    """
    return [
        (math.cos(v) * math.cos(h), math.cos(v) * math.sin(h), math.sin(v))
        for v in vertical.tolist()
        for h in horizontal.tolist()
    ]


class Rays:
    """A bundle of rays that start `nearest` away from one point and end `farthest` away from it.

    What lies nearer than `nearest` does not stop a ray: it begins behind it. A ray that begins within a solid meets
    the solid's far side.

    Args:
        world_T_source: the point, and the frame of the directions.
        directions: unit vectors.
        nearest: distance at which the rays begin [m].
        farthest: distance at which they end [m].
    """

    def __init__(
        self, world_T_source: Pose, directions: list[Vector3], *, nearest: float = 0.0, farthest: float
    ) -> None:
        if not 0.0 <= nearest < farthest:
            raise UsageError(f"rays must end behind where they begin, not run from {nearest} m to {farthest} m")
        self.nearest = nearest
        self.farthest = farthest
        self.count = len(directions)
        self._source = np.array(world_T_source.position)
        self._directions = np.array([world_T_source.rotate(direction) for direction in directions])
        self._flat = self._directions.ravel()
        self._geoms = np.empty(self.count, dtype=np.int32)
        self._distances = np.empty(self.count)

    def cast(self, simulation: Simulation) -> NDArray[np.float64]:
        """How far each ray goes, measured from the source [m], shape (count,); `inf` where nothing stops it.

        Positions must be up to date (`Simulation.refresh`).
        """
        found = self._distances
        mujoco.mj_multiRay(
            simulation.model,
            simulation.data,
            self._source,
            self._flat,
            _GROUPS,
            True,  # static geoms too
            -1,  # no body left out
            self._geoms,
            found,
            None,
            self.count,
            self.farthest,
        )
        distances = np.where((found >= 0.0) & (found <= self.farthest), found, math.inf)
        for ray in np.flatnonzero(distances < self.nearest):
            distances[ray] = self._beyond_nearest(simulation, self._directions[ray])
        return distances

    def _beyond_nearest(self, simulation: Simulation, direction: NDArray[np.float64]) -> float:
        """The distance of one ray that something would stop before it begins [m]."""
        start = self._source + self.nearest * direction
        found = mujoco.mj_ray(simulation.model, simulation.data, start, direction, _GROUPS, True, -1, None)
        distance = self.nearest + float(found)
        return distance if found >= 0.0 and distance <= self.farthest else math.inf
