"""Rays from one point, as range sensors cast them."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.engine.simulation import Simulation
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose, Vector3

SOLID_GROUPS = (1, 3)
"""Geom groups that stop a ray: what is solid. What is only drawn, such as a sensor's own housing, is in group 2."""

_GROUPS = np.array([group in SOLID_GROUPS for group in range(mujoco.mjNGROUP)], dtype=np.uint8)

_MARGIN = 1e-6
"""Added to the radius of the ball around a geom [m]: rounding must not make a ray miss what the engine has it meet."""

_AXES: tuple[Vector3, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

_FAR_AWAY = 1e9
"""Coordinate of what is to be out of reach of every ray [m]."""


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
        self._axes = np.array([world_T_source.rotate(axis) for axis in _AXES])
        ends = farthest * np.array([[0.0, 0.0, 0.0], *directions]).T
        low, high = ends.min(axis=1, keepdims=True), ends.max(axis=1, keepdims=True)
        self._middle, self._half = self._axes @ self._source[:, None] + (low + high) / 2, (high - low) / 2
        self._model: mujoco.MjModel | None = None
        self._movable: NDArray[np.intp] = np.empty(0, dtype=np.intp)
        self._radii, self._reaches = np.empty(0), np.empty((3, 0))
        self._fixed = np.empty(0)

    def cast(self, simulation: Simulation) -> NDArray[np.float64]:
        """How far each ray goes, measured from the source [m], shape (count,); `inf` where nothing stops it.

        Positions must be up to date (`Simulation.refresh`). What never moves is looked at once; after that a ray is
        cast only if something that can move is near it.
        """
        if simulation.model is not self._model:
            self._look_at_fixed(simulation)
        distances = self._fixed.copy()
        near = self._near(simulation)
        if near.size:
            found = self._ask_engine(simulation.model, simulation.data, self._directions[near], with_fixed=False)
            distances[near] = np.minimum(distances[near], found)
        if self.nearest > 0.0:
            for ray in np.flatnonzero(distances < self.nearest):
                distances[ray] = self._beyond_nearest(simulation, self._directions[ray])
        return distances

    def _near(self, simulation: Simulation) -> NDArray[np.intp]:
        """Numbers of the rays that pass through a ball around something that can move, in ascending order."""
        places = simulation.data.geom_xpos.take(self._movable, axis=0)
        # first, and mostly last: what is near the box around all rays, along the axes of the source
        is_within = np.abs(self._axes @ places.T - self._middle) <= self._reaches
        within: NDArray[np.intp] = is_within.all(axis=0).nonzero()[0]
        if not within.size:
            return within
        offsets, radii = places[within] - self._source, self._radii[within]
        # what lies behind the source is as far from a ray as from the source
        along = np.maximum(self._directions @ offsets.T, 0.0)
        meets = np.einsum("gi,gi->g", offsets, offsets) - along**2 <= radii**2
        return np.flatnonzero(meets.any(axis=1))

    def _look_at_fixed(self, simulation: Simulation) -> None:
        """Learn what can move, and how far each ray goes where nothing does."""
        model = simulation.model
        moves = model.body_weldid[model.geom_bodyid] != 0
        self._movable = np.flatnonzero(moves & np.isin(model.geom_group, SOLID_GROUPS))
        self._radii = model.geom_rbound[self._movable] + _MARGIN
        self._reaches = self._half + self._radii
        self._model = model
        alone = mujoco.MjData(model)
        mujoco.mj_kinematics(model, alone)
        alone.geom_xpos[self._movable] = _FAR_AWAY
        self._fixed = self._ask_engine(model, alone, self._directions)

    def _ask_engine(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        directions: NDArray[np.float64],
        *,
        with_fixed: bool = True,
    ) -> NDArray[np.float64]:
        """How far rays go from the source before they end [m], shape (count,); `inf` where nothing stops them."""
        count = len(directions)
        found = np.empty(count)
        mujoco.mj_multiRay(
            model,
            data,
            self._source,
            directions.ravel(),
            _GROUPS,
            with_fixed,
            -1,  # no body left out
            np.empty(count, dtype=np.int32),  # which geom: nobody asks
            found,
            None,
            count,
            self.farthest,
        )
        return np.where((found >= 0.0) & (found <= self.farthest), found, math.inf)

    def _beyond_nearest(self, simulation: Simulation, direction: NDArray[np.float64]) -> float:
        """The distance of one ray that something would stop before it begins [m]."""
        start = self._source + self.nearest * direction
        found = mujoco.mj_ray(simulation.model, simulation.data, start, direction, _GROUPS, True, -1, None)
        distance = self.nearest + float(found)
        return distance if found >= 0.0 and distance <= self.farthest else math.inf
