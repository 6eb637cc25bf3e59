"""User-defined part types and furniture, read from descriptions and MJCF files and prepared for the engine."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import hypot, pi, prod
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.cell.model.parts import PartType
from cellwright.config.models.files import ModelFileError
from cellwright.config.models.meshes import read_mesh, read_surfaces
from cellwright.config.models.model import Furniture, ModelShape, ModelShapeKind, Surface, UserModel
from cellwright.config.models.reader import MAX_PART_EXTENT
from cellwright.config.robot.model import Link
from cellwright.config.trial.trial import Trial
from cellwright.engine import colours
from cellwright.engine.shapes import HERE, Mesh, Role, Shape, Touch, Visuals, add_mesh, add_shape, bounds
from cellwright.util.pose import Pose, Vector3

_MJCF_KINDS: dict[int, ModelShapeKind] = {
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_MESH): "mesh",
}
_SHOWN_GROUPS = 3  # the engine's viewers draw the groups 0 to 2 by default
_MIN_AREA = 1e-14  # [m^2]; renderers take no mesh with less
_UNSET = (0.5, 0.5, 0.5, 1.0)  # the engine's default colour of a geom


@dataclass(frozen=True, slots=True)
class Mjcf:
    """Content of an MJCF file: shapes with their meshes, and the mass of all moving bodies together [kg]."""

    shapes: tuple[tuple[ModelShape, Mesh | None], ...]
    mass: float


def read_mjcf(path: Path) -> Mjcf:
    """Read the shapes of a file's model, in the frame of its outermost body if there is one, else of its world.

    Raises:
        ModelFileError: the engine refuses it, or it is not one rigid body.
    """
    try:
        model = mujoco.MjSpec.from_file(str(path)).compile()
    except (ValueError, OSError, RuntimeError, mujoco.FatalError) as error:
        raise ModelFileError(f"{path}: {' '.join(str(error).split())}") from None
    if any(kind != mujoco.mjtJoint.mjJNT_FREE for kind in model.jnt_type) or model.njnt > 1:
        raise ModelFileError(
            f"{path}: a model must be one rigid body with at most a free joint (got {model.njnt} joints)"
        )
    if not model.ngeom:
        raise ModelFileError(f"{path}: no shapes; add a geom")
    mass = float(model.body_mass[1:].sum())
    if not math.isfinite(mass) or not all(np.isfinite(each).all() for each in (model.geom_size, model.body_pos)):
        raise ModelFileError(f"{path}: masses, sizes and positions must be finite")
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    outermost = [body for body in range(1, model.nbody) if model.body_parentid[body] == 0]
    world_geoms = int(model.body_geomnum[0])
    frame = (
        _mjcf_pose(data.xpos[outermost[0]], data.xquat[outermost[0]])
        if len(outermost) == 1 and not world_geoms
        else Pose()
    )
    shapes = tuple(_mjcf_shape(path, model, data, geom, frame.inverse()) for geom in range(model.ngeom))
    return Mjcf(shapes, mass)


def _mjcf_shape(path: Path, model: Any, data: Any, geom: int, frame_T_world: Pose) -> tuple[ModelShape, Mesh | None]:
    kind = _MJCF_KINDS.get(int(model.geom_type[geom]))
    if kind is None:
        name = mujoco.mjtGeom(int(model.geom_type[geom])).name.removeprefix("mjGEOM_").lower()
        raise ModelFileError(f"{path}: geom type {name} is not supported (known: {', '.join(_MJCF_KINDS.values())})")
    x, y, z = (float(length) for length in model.geom_size[geom])
    size = {"box": (2 * x, 2 * y, 2 * z), "sphere": (x, 0.0, 0.0), "mesh": (1.0, 1.0, 1.0)}.get(kind, (x, 2 * y, 0.0))
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, data.geom_xmat[geom])
    is_touched = bool(model.geom_contype[geom] or model.geom_conaffinity[geom])
    material = int(model.geom_matid[geom])
    rgba = model.mat_rgba[material] if material >= 0 else model.geom_rgba[geom]
    colour = tuple(float(share) for share in rgba)
    shape = ModelShape(
        kind=kind,
        size=size,
        pose=frame_T_world @ _mjcf_pose(data.geom_xpos[geom], quaternion),
        colour=None if colour == _UNSET else (colour[0], colour[1], colour[2], colour[3]),
        is_touched=is_touched,
        is_seen=int(model.geom_group[geom]) < _SHOWN_GROUPS,
    )
    return shape, _mjcf_mesh(model, int(model.geom_dataid[geom])) if kind == "mesh" else None


def _mjcf_mesh(model: Any, mesh: int) -> Mesh:
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    face, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    vertices = np.array(model.mesh_vert[first : first + count], np.float64)
    return vertices, np.array(model.mesh_face[face : face + faces], np.int64)


def _mjcf_pose(position: Any, quaternion: Any) -> Pose:
    x, y, z = (float(each) for each in position)
    qw, qx, qy, qz = (float(each) for each in quaternion)
    return Pose((x, y, z), (qw, qx, qy, qz))


@dataclass(frozen=True, slots=True)
class PartGeometry:
    """Shapes and the meshes that they name; the `touched` shapes carry shares of the mass."""

    touched: tuple[Shape, ...]
    seen: tuple[Shape, ...]
    meshes: dict[str, Mesh]
    mass: float

    def add_meshes(self, spec: Any, visuals: Visuals) -> None:
        """Add the meshes of touched shapes to a model specification, and those of visuals, if any, to these."""
        touched, seen = ({shape.mesh for shape in shapes} for shapes in (self.touched, self.seen))
        for name, mesh in self.meshes.items():
            if name in touched:
                add_mesh(spec, name, mesh, weighs=True)
            if name in seen and self.seen != self.touched:
                visuals.meshes[name] = mesh


@dataclass(frozen=True, slots=True)
class OwnPartType:
    """User-defined part type and its form."""

    kind: PartType
    form: PartGeometry


def own_part_type(name: str, model: UserModel) -> OwnPartType:
    """Build a user-defined part type.

    Raises:
        ModelFileError: a file that the engine cannot use, or without a mass.
    """
    form = form_of(name, model)
    if not form.touched:
        raise ModelFileError(
            f"{model.mjcf}: no collision shapes, so the part would fall through the floor; let a geom collide"
        )
    if form.mass <= 0:
        raise ModelFileError(f"{model.mjcf}: no mass; give one beside the file [kg]")
    reach = max(hypot(*corner) for corner in bounds(form.touched))
    if model.mjcf is not None and reach > MAX_PART_EXTENT:
        limit = f"a part keeps within {MAX_PART_EXTENT:g} m"
        raise ModelFileError(f"{model.mjcf}: reaches {reach:.2f} m from its origin; {limit}")
    # collision shapes are drawn, unless there are visual ones
    seen = () if form.seen == form.touched else form.seen
    return OwnPartType(PartType(name, form.mass, form.touched, seen), form)


def model_problems(trial: Trial) -> list[str]:
    """Return the engine's errors about a trial's user-defined models; the description has been checked before."""
    problems = []
    models = [*trial.part_models.items(), *((f"furniture|{piece.name}", piece.model) for piece in trial.furniture)]
    for name, model in models:
        try:
            form_of(name, model) if "|" in name else own_part_type(name, model)
        except ModelFileError as error:
            problems.append(str(error))
    return problems


def add_furniture(spec: Any, visuals: Visuals, pieces: Iterable[Furniture]) -> None:
    """Add the furniture of the cell to a model specification and to its visuals; all of it is fixed.

    Raises:
        ModelFileError: a file that the engine cannot use.
    """
    for piece in pieces:
        name = f"furniture|{piece.name}"
        form = form_of(name, piece.model)
        form.add_meshes(spec, visuals)
        body = spec.worldbody.add_body(name=name, pos=piece.pose.position, quat=piece.pose.quaternion)
        for shape in form.touched:
            add_shape(body, shape, Role.BOTH if shape in form.seen else Role.SOLID, Touch.FIXED)
        visuals.add(name, *(shape for shape in form.seen if shape not in form.touched))


def add_link(spec: Any, visuals: Visuals, body: Any, link: Link) -> list[Any]:
    """Add the shapes of a robot's link to its body; return the geoms that it touches with.

    Raises:
        ModelFileError: a mesh cannot be used.
    """
    form = form_of(link.name, UserModel(link.shapes))
    form.add_meshes(spec, visuals)
    visuals.add(link.name, *(shape for shape in form.seen if shape not in form.touched))
    roles = [Role.BOTH if shape in form.seen else Role.SOLID for shape in form.touched]
    return [
        add_shape(body, replace(shape, share=0.0), role, Touch.ROBOT)
        for shape, role in zip(form.touched, roles, strict=True)
    ]


def form_of(name: str, model: UserModel) -> PartGeometry:
    """Return the shapes of a model; its meshes are named after it.

    Raises:
        ModelFileError: a file that cannot be used.
    """
    read = [(shape, _mesh_of(shape)) for shape in model.shapes]
    mass = model.mass or 0.0
    if model.mjcf is not None:
        mjcf_file = read_mjcf(model.mjcf)
        read = [(shape, mesh) for shape, mesh in mjcf_file.shapes]
        mass = mjcf_file.mass if model.mass is None else model.mass
    volumes = [_volume(shape, mesh) if shape.is_touched else 0.0 for shape, mesh in read]
    whole = sum(volumes)
    meshes: dict[str, Mesh] = {}
    touched, seen = [], []
    for number, ((described, mesh), volume) in enumerate(zip(read, volumes, strict=True)):
        shape = _shape(described, described.colour or model.colour or colours.STEEL)
        surfaces = _coloured_surfaces(described)
        if mesh is not None and (described.is_touched or not surfaces):
            shape, meshes[f"{name}|mesh_{number}"] = _centred(shape, mesh, f"{name}|mesh_{number}")
        shape = replace(shape, share=volume / whole if whole else 0.0)
        if described.is_touched:
            touched.append(shape)
        if described.is_seen and not surfaces:
            seen.append(shape)
        for part, surface in enumerate(surfaces):
            key = f"{name}|mesh_{number}_{part}"
            own = _shape(described, surface.colour or model.colour or colours.STEEL)
            own, meshes[key] = _centred(own, (surface.vertices * described.size, surface.triangles), key)
            seen.append(own)
    return PartGeometry(tuple(touched), tuple(seen), meshes, mass)


def _mesh_of(shape: ModelShape) -> Mesh | None:
    if shape.mesh is None:
        return None
    vertices, triangles = read_mesh(shape.mesh)
    vertices = vertices * shape.size
    if len(vertices) < 4 or _area(vertices, triangles) < _MIN_AREA:
        raise ModelFileError(f"{shape.mesh}: a mesh needs at least 4 vertices, and triangles with an area")
    return vertices, triangles


def _coloured_surfaces(shape: ModelShape) -> tuple[Surface, ...]:
    """Return the surfaces of a mesh that is drawn in the colours of its file; none if it has other colours."""
    if shape.mesh is None or not shape.is_seen or shape.colour is not None:
        return ()
    surfaces = read_surfaces(shape.mesh)
    return surfaces if any(surface.colour is not None for surface in surfaces) else ()


def _area(vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> float:
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def _shape(shape: ModelShape, colour: tuple[float, float, float, float]) -> Shape:
    x, y, z = shape.size
    match shape.kind:
        case "box":
            size: Vector3 = (x / 2, y / 2, z / 2)
        case "cylinder" | "capsule":
            size = (x, y / 2, 0.0)
        case "sphere":
            size = (x, 0.0, 0.0)
        case "mesh":
            size = (0.0, 0.0, 0.0)
    return Shape(shape.kind, size, shape.pose, colour)


def _centred(shape: Shape, mesh: Mesh, name: str) -> tuple[Shape, Mesh]:
    """Return a mesh whose box is centred on its origin, and the shape that keeps it in place."""
    vertices, triangles = mesh
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    x, y, z = ((lower + upper) / 2).tolist()
    half_x, half_y, half_z = ((upper - lower) / 2).tolist()
    place = shape.pose @ Pose((x, y, z), HERE.quaternion)
    moved = replace(shape, pose=place, size=(half_x, half_y, half_z), mesh=name)
    return moved, (vertices - (lower + upper) / 2, triangles)


def _volume(shape: ModelShape, mesh: Mesh | None) -> float:
    """Return the volume [m^3] by which the mass is shared; of a mesh, what its triangles enclose, else its box."""
    if mesh is not None:
        vertices, triangles = mesh
        a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
        enclosed = abs(float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6))
        box = float(np.prod(vertices.max(axis=0) - vertices.min(axis=0)))
        return enclosed if enclosed > 1e-3 * box else box
    radius, length = shape.size[0], shape.size[1]
    match shape.kind:
        case "box":
            return prod(shape.size)
        case "sphere":
            return 4 / 3 * pi * radius**3
        case "capsule":
            return pi * radius**2 * (length + 4 / 3 * radius)
        case _:
            return pi * radius**2 * length
