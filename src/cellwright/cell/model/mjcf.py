"""Reads shapes and mass from a file in the engine's own format, MJCF, by having the engine compile it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from cellwright.config.models.files import ModelFileError
from cellwright.config.models.model import ModelShape, ModelShapeKind
from cellwright.engine.geometry.meshes import Mesh
from cellwright.util.pose import Pose

_KINDS: dict[int, ModelShapeKind] = {
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_MESH): "mesh",
}
_SHOWN_GROUPS = 3  # the engine's viewers draw the groups 0 to 2 unless told otherwise
_UNSET = (0.5, 0.5, 0.5, 1.0)  # the engine's own colour of a geom that was given none


@dataclass(frozen=True, slots=True)
class Mjcf:
    """What is in a file: shapes with their meshes, and the mass of all moving bodies together [kg]."""

    shapes: tuple[tuple[ModelShape, Mesh | None], ...]
    mass: float


def read_mjcf(path: Path) -> Mjcf:
    """The shapes of a file's model, in the frame of its outermost body where there is one, else of its world.

    Raises:
        ModelFileError: the engine refuses it, or it is not one rigid body.
    """
    try:
        model = mujoco.MjSpec.from_file(str(path)).compile()
    except (ValueError, OSError, RuntimeError, mujoco.FatalError) as error:
        raise ModelFileError(f"{path}: {' '.join(str(error).split())}") from None
    if any(kind != mujoco.mjtJoint.mjJNT_FREE for kind in model.jnt_type) or model.njnt > 1:
        raise ModelFileError(f"{path}: has joints; a model is one rigid body, with a free joint at most")
    if not model.ngeom:
        raise ModelFileError(f"{path}: no shapes in it")
    mass = float(model.body_mass[1:].sum())
    if not math.isfinite(mass) or not all(np.isfinite(each).all() for each in (model.geom_size, model.body_pos)):
        raise ModelFileError(f"{path}: a number in it is not finite")
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    outermost = [body for body in range(1, model.nbody) if model.body_parentid[body] == 0]
    world_geoms = int(model.body_geomnum[0])
    frame = (
        _pose(data.xpos[outermost[0]], data.xquat[outermost[0]]) if len(outermost) == 1 and not world_geoms else Pose()
    )
    shapes = tuple(_shape(path, model, data, geom, frame.inverse()) for geom in range(model.ngeom))
    return Mjcf(shapes, mass)


def _shape(path: Path, model: Any, data: Any, geom: int, frame_T_world: Pose) -> tuple[ModelShape, Mesh | None]:
    kind = _KINDS.get(int(model.geom_type[geom]))
    if kind is None:
        name = mujoco.mjtGeom(int(model.geom_type[geom])).name.removeprefix("mjGEOM_").lower()
        raise ModelFileError(f"{path}: a geom of type {name} is not read (known: {', '.join(_KINDS.values())})")
    x, y, z = (float(length) for length in model.geom_size[geom])
    size = {"box": (2 * x, 2 * y, 2 * z), "sphere": (x, 0.0, 0.0), "mesh": (1.0, 1.0, 1.0)}.get(kind, (x, 2 * y, 0.0))
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, data.geom_xmat[geom])
    is_touched = bool(model.geom_contype[geom] or model.geom_conaffinity[geom])
    colour = tuple(float(share) for share in _rgba(model, geom))
    shape = ModelShape(
        kind=kind,
        size=size,
        pose=frame_T_world @ _pose(data.geom_xpos[geom], quaternion),
        colour=None if colour == _UNSET else (colour[0], colour[1], colour[2], colour[3]),
        is_touched=is_touched,
        is_seen=int(model.geom_group[geom]) < _SHOWN_GROUPS,
    )
    return shape, _mesh(model, int(model.geom_dataid[geom])) if kind == "mesh" else None


def _rgba(model: Any, geom: int) -> Any:
    material = int(model.geom_matid[geom])
    return model.mat_rgba[material] if material >= 0 else model.geom_rgba[geom]


def _mesh(model: Any, mesh: int) -> Mesh:
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    face, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    vertices = np.array(model.mesh_vert[first : first + count], np.float64)
    return vertices, np.array(model.mesh_face[face : face + faces], np.int64)


def _pose(position: Any, quaternion: Any) -> Pose:
    x, y, z = (float(each) for each in position)
    qw, qx, qy, qz = (float(each) for each in quaternion)
    return Pose((x, y, z), (qw, qx, qy, qz))
