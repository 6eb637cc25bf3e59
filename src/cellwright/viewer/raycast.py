"""Many rays into a cell at once: which geom each one meets, how far away, and how the surface is turned there.

The engine casts bundles of rays that share an origin (`mj_multiRay`). A primary ray starts at the camera, so a picture
is one bundle. A shadow is one too: seen from the lamp, a point is lit when nothing stands before it.

The engine casts into its own tables of shapes, so this needs no graphics library, no display and no GPU. It releases
the interpreter's lock, so bundles are shared out among threads; a ray does not depend on its neighbours, so neither
does the result on how they were shared out.
"""

from __future__ import annotations

import copy
import os
from collections.abc import Collection
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.viewer.surfaces import geom_colours

PICTURE_GROUPS = frozenset({1, 2})
"""Geom groups that pictures show: what is seen and touched, and what is only seen. Group 3 is only touched."""

_OPAQUE, _TRANSLUCENT, _HIDDEN = 0, 1, 5
_SHADOW_TOLERANCE = 1e-4  # [m]; far above rounding, far below the thinnest sheet in a cell (1 mm)
_FAR = 1e4  # [m]
_SMALLEST_SHARE = 4096  # rays; below this a thread costs more than it brings


@dataclass(frozen=True, slots=True)
class Hits:
    """What n rays met.

    Attributes:
        geom: (n,) geom id, -1 where nothing was met.
        distance: (n,) [m], infinite where nothing was met.
        normal: (n, 3) unit normal of the surface, world frame, on the side of the ray; zero where nothing was met.
    """

    geom: NDArray[np.int32]
    distance: NDArray[np.float64]
    normal: NDArray[np.float64]


class RayCaster:
    """Casts rays into a cell as it stands at the moment of construction.

    It works on copies of its own: neither `model` nor `data` is written to, nor kept.

    Args:
        model: the cell.
        data: its state; only positions are read.
        groups: the geom groups that rays meet.
        threads: how many threads share the work; by default one per core, four at most.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        *,
        groups: Collection[int] = PICTURE_GROUPS,
        threads: int | None = None,
    ) -> None:
        self.colours = geom_colours(model)
        """Colour and opacity (ngeom, 4) of every geom, as in the scene, sRGB 0..1."""
        self._model = copy.copy(model)
        drawn = np.isin(model.geom_group, sorted(groups)) & (self.colours[:, 3] > 0)
        translucent = drawn & (self.colours[:, 3] < 1)
        # Rays pass through whatever has no opacity; here only the group decides.
        self._model.geom_matid[:] = -1
        self._model.geom_rgba[:] = 1.0
        self._model.geom_group[:] = np.select([translucent, drawn], [_TRANSLUCENT, _OPAQUE], _HIDDEN)
        self._workers = [self._still(data) for _ in range(threads or min(4, os.cpu_count() or 1))]

    @property
    def still(self) -> mujoco.MjData:
        """The cell as the rays find it, to be read only."""
        return self._workers[0]

    def _still(self, data: mujoco.MjData) -> mujoco.MjData:
        """A state of its own (the engine's scratch memory is part of it) with every body in its present place.

        Freshly made, so that nothing sleeps in it and the kinematics touch every body.
        """
        still = mujoco.MjData(self._model)
        still.qpos[:] = data.qpos
        still.mocap_pos[:] = data.mocap_pos
        still.mocap_quat[:] = data.mocap_quat
        mujoco.mj_kinematics(self._model, still)
        return still

    def cast(
        self, origin: NDArray[np.float64], directions: NDArray[np.float64], *, through_translucent: bool = False
    ) -> Hits:
        """What the rays from `origin` (3,) [m] along unit vectors `directions` (n, 3) meet first."""
        geom, distance, flat = self._shoot(origin, directions, through_translucent=through_translucent, normals=True)
        normal = flat.reshape(-1, 3)
        from_inside = np.einsum("ij,ij->i", normal, directions) > 0
        normal[from_inside] *= -1
        missed = geom < 0
        distance[missed] = np.inf
        normal[missed] = 0.0
        return Hits(geom, distance, normal)

    def reaches(self, lamp: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which of the surface `points` (n, 3) [m] the light of a point lamp (3,) [m] reaches.

        Translucent things cast no shadow. A surface that faces away from the lamp may come out either way where it is
        thinner than a tenth of a millimetre: its shading has to ask for the side as well.
        """
        rays = points - lamp
        geom, share, _ = self._shoot(lamp, rays, through_translucent=True, normals=False)
        length = np.sqrt(np.einsum("ij,ij->i", rays, rays))
        reached: NDArray[np.bool_] = (geom < 0) | ((1.0 - share) * length < _SHADOW_TOLERANCE)
        return reached

    def _shoot(
        self,
        origin: NDArray[np.float64],
        rays: NDArray[np.float64],
        *,
        through_translucent: bool,
        normals: bool,
    ) -> tuple[NDArray[np.int32], NDArray[np.float64], NDArray[np.float64]]:
        count = len(rays)
        geom = np.full(count, -1, np.int32)
        distance = np.full(count, -1.0)
        normal = np.zeros(3 * count if normals else 0)
        flat = np.ascontiguousarray(rays, np.float64).reshape(-1)
        groups = np.zeros(mujoco.mjNGROUP, np.uint8)
        groups[_OPAQUE] = 1
        groups[_TRANSLUCENT] = not through_translucent

        def share(worker: int, first: int, last: int) -> None:
            mujoco.mj_multiRay(
                self._model,
                self._workers[worker],
                origin,
                flat[3 * first : 3 * last],
                groups,
                True,  # static geoms too
                -1,  # no body left out
                geom[first:last],
                distance[first:last],
                normal[3 * first : 3 * last] if normals else None,
                last - first,
                _FAR,
            )

        shares = max(1, min(len(self._workers), count // _SMALLEST_SHARE))
        borders = [count * i // shares for i in range(shares + 1)]
        if shares == 1:
            if count:
                share(0, 0, count)
        else:
            with ThreadPoolExecutor(shares) as pool:
                list(pool.map(share, range(shares), borders[:-1], borders[1:]))
        return geom, distance, normal
