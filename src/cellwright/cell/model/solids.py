"""Solid shapes of a cell as JSON values: what an arm must not hit, and the arm itself."""

from collections.abc import Iterable
from typing import Any

import mujoco
import numpy as np

from cellwright.cell.model.build import World
from cellwright.cell.model.furniture import SHELF_BODY

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
        shape: dict[str, Any] = {
            "body": world.arm_links.get(name, name) or "world",
            "type": (kind := _TYPES[int(model.geom_type[geom])]),
        }
        if name in world.arm_links:
            frame, position, quaternion = world.arm_links[name], model.geom_pos[geom], model.geom_quat[geom]
        else:
            quaternion = np.zeros(4)
            mujoco.mju_mat2Quat(quaternion, data.geom_xmat[geom])
            frame, position = "world", data.geom_xpos[geom]
        shape |= {"position": _rounded(position), "quaternion": _rounded(quaternion)}
        shape["size"] = _rounded(model.geom_size[geom][: _SIZES[kind]])
        if kind == "mesh":
            vertices, shape["triangles"] = _hull(model, int(model.geom_dataid[geom]))
            shape["vertices"] = [_rounded(each) for each in vertices]
        found.setdefault(frame, []).append(shape)
    return found


def _hull(model: Any, mesh: int) -> tuple[Any, list[list[int]]]:
    """Return a mesh's convex hull: vertices [m], shape (n, 3), and its triangles; a file may have a million inside it.

    The engine's graph of a hull begins with how many vertices and faces there are. For each vertex it has an address
    and the number in the mesh. Then come the edges, and at last three numbers of vertices for each face.
    """
    graph = model.mesh_graph[int(model.mesh_graphadr[mesh]) :]
    vertices, faces = int(graph[0]), int(graph[1])
    corners = np.sort(graph[2 + vertices : 2 + 2 * vertices])
    triangles = graph[2 + 3 * vertices + 3 * faces :][: 3 * faces].reshape(-1, 3)
    places = model.mesh_vert[int(model.mesh_vertadr[mesh]) + corners]
    return places, np.searchsorted(corners, triangles).tolist()


def _rounded(values: Iterable[float]) -> list[float]:
    """Round to a ten-thousandth of a millimetre in lengths; quaternions stay within 1e-7 of unit ones."""
    return [round(float(each), 7) for each in values]
