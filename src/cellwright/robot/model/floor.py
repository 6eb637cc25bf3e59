"""A floor to be seen under a robot: nothing touches it, for the original has none."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np

from cellwright.engine.geometry import colours

FLOOR = "floor"
"""Name of the geom."""

_SEEN = 2  # the group of geoms that are only seen
_AXES = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


def add_floor(spec: Any) -> None:
    """An endless floor at height 0, until `put_floor_under` says where it is."""
    spec.worldbody.add_geom(
        name=FLOOR,
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=(0.0, 0.0, 1.0),  # a plane of size 0 has no end
        rgba=colours.FLOOR,
        group=_SEEN,
        contype=0,
        conaffinity=0,
    )


def put_floor_under(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Put the floor where the lowest point of what is seen stands on it, in the posture of `data`."""
    corners = seen_corners(model, data)
    if len(corners):
        floor = model.geom(FLOOR).id
        model.geom_pos[floor, 2] = corners[:, 2].min()
        model.geom_sameframe[floor] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE  # else the engine takes the world's height


def seen_corners(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Corners (n, 3) [m] of the boxes around all shapes that are seen, in the world; the floor has none.

    A box lies along the axes of its shape. `data` is only read; what was computed from `qpos` before does not matter.
    """
    still = mujoco.MjData(model)
    still.qpos[:], still.mocap_pos[:], still.mocap_quat[:] = data.qpos, data.mocap_pos, data.mocap_quat
    mujoco.mj_kinematics(model, still)
    seen = np.flatnonzero((model.geom_group <= _SEEN) & (model.geom_type != mujoco.mjtGeom.mjGEOM_PLANE))
    middles, halves = model.geom_aabb[seen, :3], model.geom_aabb[seen, 3:]
    local = middles[:, None, :] + halves[:, None, :] * _AXES
    turned = np.einsum("gij,gkj->gki", still.geom_xmat[seen].reshape(-1, 3, 3), local)
    corners: np.ndarray[Any, np.dtype[np.float64]] = (turned + still.geom_xpos[seen][:, None, :]).reshape(-1, 3)
    return corners
