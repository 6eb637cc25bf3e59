"""Solid shapes of a cell as JSON values: what an arm must not hit, and the arm itself."""

from collections.abc import Iterable
from typing import Any

import mujoco
import numpy as np

from cellwright.cell.model.build import World
from cellwright.cell.model.furniture import SHELF_BODY
from cellwright.engine.shapes import Mesh

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
    data = world.initial_data()
    found: dict[str, list[dict[str, Any]]] = {"world": []}
    for geom in solid_geoms(world):
        name = model.body(int(model.geom_bodyid[geom])).name
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
            vertices, triangles = hull_of(model, geom)
            shape["vertices"], shape["triangles"] = [_rounded(each) for each in vertices], triangles.tolist()
        found.setdefault(frame, []).append(shape)
    return found


def solid_geoms(world: World) -> list[int]:
    """Return the geoms that something can touch, but for those of parts and of the shelf."""
    model = world.model
    # the shelf is out of the cell, and as large as there are parts
    hidden = {model.body(SHELF_BODY).id, *(part.body for part in (*world.parts, *world.bodies))}
    return [
        geom
        for geom in range(model.ngeom)
        if (model.geom_contype[geom] or model.geom_conaffinity[geom]) and int(model.geom_bodyid[geom]) not in hidden
    ]


def hull_of(model: Any, geom: int) -> Mesh:
    """Return the convex hull of a mesh in the frame of its geom; a file may have a million vertices inside it.

    The engine's graph of a hull begins with how many vertices and faces there are. For each vertex it has an address
    and the number in the mesh. Then come the edges, and at last three numbers of vertices for each face.
    """
    mesh = int(model.geom_dataid[geom])
    graph = model.mesh_graph[int(model.mesh_graphadr[mesh]) :]
    vertices, faces = int(graph[0]), int(graph[1])
    corners = np.sort(graph[2 + vertices : 2 + 2 * vertices])
    triangles = graph[2 + 3 * vertices + 3 * faces :][: 3 * faces].reshape(-1, 3)
    places = model.mesh_vert[int(model.mesh_vertadr[mesh]) + corners]
    return places, np.searchsorted(corners, triangles)


def _rounded(values: Iterable[float]) -> list[float]:
    """Round to a ten-thousandth of a millimetre in lengths; quaternions stay within 1e-7 of unit ones."""
    return [round(float(each), 7) for each in values]
