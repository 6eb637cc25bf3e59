"""Ray caster for many rays at once: the geom that each one hits, its distance, and the surface's normal.

The engine casts bundles of rays that share an origin (`mj_multiRay`). A primary ray starts at the camera, so a picture
is one bundle. A shadow is one too: a point is lit if nothing is between it and the lamp.

The engine casts into its own tables of shapes, so this needs no graphics library, display or GPU. It releases the
interpreter's lock meanwhile.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.scene.scene import SEEN

_OPAQUE, _TRANSLUCENT, _HIDDEN = 0, 1, 5
_SHADOW_TOLERANCE = 1e-4  # [m]; far above rounding, far below the thinnest sheet in a cell (1 mm)
_FAR = 1e4  # [m]


@dataclass(frozen=True, slots=True)
class Hits:
    """Hits of n rays.

    Attributes:
        geom: (n,) geom id, -1 for a miss.
        distance: (n,) [m], infinite for a miss.
        normal: (n, 3) unit normal of the surface, world frame, on the side of the ray; zero for a miss.
    """

    geom: NDArray[np.int32]
    distance: NDArray[np.float64]
    normal: NDArray[np.float64]

    def __getitem__(self, which: slice) -> Hits:
        """Hits of some of the rays."""
        return Hits(self.geom[which], self.distance[which], self.normal[which])


class RayCaster:
    """Ray caster for a cell in its state at construction.

    It works on copies: it neither changes nor keeps `model` and `data`, of which it reads positions only. The copies
    include the engine's scratch memory, so two threads need two casters.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._model = copy.copy(model)
        opacity = model.geom_rgba[:, 3]
        # A geom's group is its layer in a scene.
        drawn = np.isin(model.geom_group, sorted(SEEN)) & (opacity > 0)
        translucent = drawn & (opacity < 1)
        # Rays pass through a geom without opacity; here only the group decides.
        self._model.geom_matid[:] = -1
        self._model.geom_rgba[:] = 1.0
        self._model.geom_group[:] = np.select([translucent, drawn], [_TRANSLUCENT, _OPAQUE], _HIDDEN)
        # A new state, in which nothing sleeps, so that the kinematics update every body.
        self.still = mujoco.MjData(self._model)
        """State of the cell that the rays see; read-only."""
        self.still.qpos[:] = data.qpos
        self.still.mocap_pos[:] = data.mocap_pos
        self.still.mocap_quat[:] = data.mocap_quat
        mujoco.mj_kinematics(self._model, self.still)

    def cast(
        self, origin: NDArray[np.float64], directions: NDArray[np.float64], *, through_translucent: bool = False
    ) -> Hits:
        """Return the first hits of rays from `origin` (3,) [m] along unit vectors `directions` (n, 3)."""
        geom, distance, flat = self._shoot(origin, directions, through_translucent=through_translucent, normals=True)
        normal = flat.reshape(-1, 3)
        from_inside = np.einsum("ij,ij->i", normal, directions) > 0
        normal[from_inside] *= -1
        missed = geom < 0
        distance[missed] = np.inf
        normal[missed] = 0.0
        return Hits(geom, distance, normal)

    def reaches(self, lamp: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which surface `points` (n, 3) [m] the light of a point lamp (3,) [m] reaches.

        Translucent surfaces cast no shadow. A surface that faces away from the lamp may get either result where it is
        thinner than a tenth of a millimetre: its shading must check the side as well.
        """
        rays = points - lamp
        geom, share, _ = self._shoot(lamp, rays, through_translucent=True, normals=False)
        length = np.sqrt(np.einsum("ij,ij->i", rays, rays))
        reached: NDArray[np.bool_] = (geom < 0) | ((1.0 - share) * length < _SHADOW_TOLERANCE)
        return reached

    def _shoot(
        self, origin: NDArray[np.float64], rays: NDArray[np.float64], *, through_translucent: bool, normals: bool
    ) -> tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]:
        count = len(rays)
        geom = np.full(count, -1, np.int32)
        distance = np.full(count, -1.0)
        normal = np.zeros(3 * count if normals else 0)
        groups = np.zeros(mujoco.mjNGROUP, np.uint8)
        groups[_OPAQUE] = 1
        groups[_TRANSLUCENT] = not through_translucent
        if count:
            mujoco.mj_multiRay(
                self._model,
                self.still,
                origin,
                np.ascontiguousarray(rays, np.float64).reshape(-1),
                groups,
                True,  # static geoms too
                -1,  # no body excluded
                geom,
                distance,
                normal if normals else None,
                count,
                _FAR,
            )
        return geom, distance, normal
