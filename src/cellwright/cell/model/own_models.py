"""Part types and furniture of somebody's own, made ready for the engine."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import hypot, pi, prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cellwright.cell.model.mjcf import read_mjcf
from cellwright.cell.model.parts import PartType
from cellwright.config.models.files import ModelFileError
from cellwright.config.models.meshes import read_mesh
from cellwright.config.models.model import Furniture, Model, ModelShape
from cellwright.config.models.section import FARTHEST_REACH
from cellwright.config.trial.trial import Trial
from cellwright.engine.geometry import colours
from cellwright.engine.geometry.meshes import Mesh, add_mesh
from cellwright.engine.geometry.shapes import HERE, Role, Shape, Touch, add_shape, bounds
from cellwright.util.pose import Pose, Vector3


@dataclass(frozen=True, slots=True)
class Form:
    """Shapes, of which `touched` carry shares of the mass, and the meshes that they name."""

    touched: tuple[Shape, ...]
    seen: tuple[Shape, ...]
    meshes: dict[str, Mesh]
    mass: float

    def add_meshes(self, spec: Any) -> None:
        """Give a model specification the meshes."""
        weighing = {shape.mesh for shape in self.touched}
        for name, mesh in self.meshes.items():
            add_mesh(spec, name, mesh, weighs=name in weighing)


@dataclass(frozen=True, slots=True)
class OwnPartType:
    """A part type of somebody's own and its form."""

    kind: PartType
    form: Form


def own_part_types(trial: Trial) -> dict[str, OwnPartType]:
    """The part types of a trial's own, by name.

    Raises:
        ModelFileError: a file that the engine cannot use, or without a mass.
    """
    return {name: _part_type(name, model) for name, model in trial.part_models.items()}


def _part_type(name: str, model: Model) -> OwnPartType:
    form = form_of(name, model)
    if not form.touched:
        raise ModelFileError(f"{model.mjcf}: nothing in it can be touched, so it would fall through the floor")
    if form.mass <= 0:
        raise ModelFileError(f"{model.mjcf}: no mass in it; give one beside the file [kg]")
    reach = max(hypot(*corner) for corner in bounds(form.touched))
    if model.mjcf is not None and reach > FARTHEST_REACH:
        limit = f"a part keeps within {FARTHEST_REACH:g} m"
        raise ModelFileError(f"{model.mjcf}: reaches {reach:.2f} m from its origin; {limit}")
    # what is touched is drawn, unless something else is
    seen = () if form.seen == form.touched else form.seen
    return OwnPartType(PartType(name, form.mass, form.touched, seen), form)


def problems(trial: Trial) -> list[str]:
    """What the engine finds wrong with the models of a trial's own; the description has been checked before."""
    found = []
    models = [*trial.part_models.items(), *((f"furniture|{piece.name}", piece.model) for piece in trial.furniture)]
    for name, model in models:
        try:
            form_of(name, model) if "|" in name else _part_type(name, model)
        except ModelFileError as error:
            found.append(str(error))
    return found


def add_furniture(spec: Any, pieces: Iterable[Furniture]) -> None:
    """Put what stands in the cell into a model specification; nothing of it moves.

    Raises:
        ModelFileError: a file that the engine cannot use.
    """
    for piece in pieces:
        name = f"furniture|{piece.name}"
        form = form_of(name, piece.model)
        form.add_meshes(spec)
        body = spec.worldbody.add_body(name=name, pos=piece.pose.position, quat=piece.pose.quaternion)
        for shape in form.touched:
            add_shape(body, shape, Role.BOTH if shape in form.seen else Role.SOLID, Touch.FIXED)
        for shape in form.seen:
            if shape not in form.touched:
                add_shape(spec.worldbody, shape.moved(piece.pose), Role.SEEN)


def form_of(name: str, model: Model) -> Form:
    """The shapes of a model; its meshes are named after it.

    Raises:
        ModelFileError: a file that cannot be used.
    """
    read = [(shape, _mesh_of(shape)) for shape in model.shapes]
    mass = model.mass or 0.0
    if model.mjcf is not None:
        found = read_mjcf(model.mjcf)
        read = [(shape, mesh) for shape, mesh in found.shapes]
        mass = found.mass if model.mass is None else model.mass
    volumes = [_volume(shape, mesh) if shape.is_touched else 0.0 for shape, mesh in read]
    whole = sum(volumes)
    meshes: dict[str, Mesh] = {}
    touched, seen = [], []
    for number, ((described, mesh), volume) in enumerate(zip(read, volumes, strict=True)):
        shape = _shape(described, described.colour or model.colour or colours.STEEL)
        if mesh is not None:
            shape, meshes[f"{name}|mesh_{number}"] = _centred(shape, mesh, f"{name}|mesh_{number}")
        shape = replace(shape, share=volume / whole if whole else 0.0)
        if described.is_touched:
            touched.append(shape)
        if described.is_seen:
            seen.append(shape)
    return Form(tuple(touched), tuple(seen), meshes, mass)


def _mesh_of(shape: ModelShape) -> Mesh | None:
    if shape.mesh is None:
        return None
    vertices, triangles = read_mesh(shape.mesh)
    return vertices * shape.size, triangles


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
    """A mesh whose box is centred on its origin, and the shape that shows it where it was."""
    vertices, triangles = mesh
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    x, y, z = ((lower + upper) / 2).tolist()
    half_x, half_y, half_z = ((upper - lower) / 2).tolist()
    place = shape.pose @ Pose((x, y, z), HERE.quaternion)
    moved = replace(shape, pose=place, size=(half_x, half_y, half_z), mesh=name)
    return moved, (vertices - (lower + upper) / 2, triangles)


def _volume(shape: ModelShape, mesh: Mesh | None) -> float:
    """Volume [m^3], by which the mass is shared; of a mesh, what its triangles enclose, else its box."""
    if mesh is not None:
        return _enclosed(*mesh)
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


def _enclosed(vertices: NDArray[np.float64], triangles: NDArray[np.int64]) -> float:
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    signed = float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)
    box = float(np.prod(vertices.max(axis=0) - vertices.min(axis=0)))
    return abs(signed) if abs(signed) > 1e-3 * box else box
