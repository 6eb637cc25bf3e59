"""Solid shapes of a cell as JSON values: what an arm must not hit, and the arm itself."""

from collections.abc import Iterable
from typing import Any

import mujoco
import numpy as np

from cellwright.cell.model.build import World
from cellwright.cell.model.furniture import SHELF_BODY
from cellwright.config.layout import ARM_FRAMES

_TYPES = {
    mujoco.mjtGeom.mjGEOM_PLANE: "plane",
    mujoco.mjtGeom.mjGEOM_SPHERE: "sphere",
    mujoco.mjtGeom.mjGEOM_CAPSULE: "capsule",
    mujoco.mjtGeom.mjGEOM_CYLINDER: "cylinder",
    mujoco.mjtGeom.mjGEOM_ELLIPSOID: "ellipsoid",
    mujoco.mjtGeom.mjGEOM_BOX: "box",
    mujoco.mjtGeom.mjGEOM_MESH: "mesh",
}
_SIZES = {"plane": 0, "sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3, "mesh": 0}


def solids(world: World) -> dict[str, list[dict[str, Any]]]:
    """Return the shapes that something can touch, but for parts, by frame: links that the arm moves, and "world".

    `Client.solids` describes their values.
    """
    model = world.model
    data = mujoco.MjData(model)
    world.set_initial_posture(data)
    mujoco.mj_kinematics(model, data)
    # the shelf is out of the cell, and as large as there are parts
    hidden = {model.body(SHELF_BODY).id, *(part.body for part in (*world.parts, *world.bodies))}
    found: dict[str, list[dict[str, Any]]] = {"world": []}
    for geom in range(model.ngeom):
        body = int(model.geom_bodyid[geom])
        if body in hidden or not (model.geom_contype[geom] or model.geom_conaffinity[geom]):
            continue
        name = model.body(body).name
        shape: dict[str, Any] = {"body": name or "world", "type": (kind := _TYPES[int(model.geom_type[geom])])}
        if name in ARM_FRAMES[1:]:
            frame, position, quaternion = name, model.geom_pos[geom], model.geom_quat[geom]
        else:
            quaternion = np.zeros(4)
            mujoco.mju_mat2Quat(quaternion, data.geom_xmat[geom])
            frame, position = "world", data.geom_xpos[geom]
        shape |= {"position": _rounded(position), "quaternion": _rounded(quaternion)}
        shape["size"] = _rounded(model.geom_size[geom][: _SIZES[kind]])
        if kind == "mesh":
            shape["vertices"] = [_rounded(each) for each in _corners(model, int(model.geom_dataid[geom]))]
        found.setdefault(frame, []).append(shape)
    return found


def _corners(model: Any, mesh: int) -> Any:
    """Return the vertices of a mesh's convex hull [m], shape (n, 3): a file may have a million inside it."""
    graph = model.mesh_graph[int(model.mesh_graphadr[mesh]) :]
    count = int(graph[0])
    return model.mesh_vert[int(model.mesh_vertadr[mesh]) + np.sort(graph[2 + count : 2 + 2 * count])]


def _rounded(values: Iterable[float]) -> list[float]:
    """Round to a ten-thousandth of a millimetre in lengths; quaternions stay within 1e-7 of unit ones."""
    return [round(float(each), 7) for each in values]
