"""Shapes of a robot's links in the engine: what is seen, and, where links may touch each other, what is touched."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.config.models.meshes import is_flat, read_mesh
from cellwright.config.models.model import ModelShape
from cellwright.engine.geometry.meshes import Mesh, add_mesh
from cellwright.util.pose import IDENTITY_QUATERNION, Pose, Vector3

GREY = (0.62, 0.64, 0.67, 1.0)
"""Of shapes that have no colour."""
LEAST_LENGTH = 1e-4
"""Least half length of a shape [m]: the engine takes none that is thinner."""

_KINDS = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
}


class ShapeBuilder:
    """Gives bodies their shapes; a mesh that many links use is loaded once.

    Args:
        spec: the model specification that the meshes go into.
        is_touched: whether links may touch each other. If not, what is only touched is left out.
    """

    def __init__(self, spec: Any, *, is_touched: bool) -> None:
        self._spec = spec
        self._is_touched = is_touched
        self._files: dict[Path, Mesh] = {}
        self._names: dict[tuple[Path, Vector3], str] = {}

    def add(self, body: Any, shape: ModelShape) -> bool:
        """Give a body a shape, without weight; returns whether it is one that is touched."""
        is_touched = shape.is_touched and self._is_touched
        if not (is_touched or shape.is_seen):
            return False
        if shape.mesh is not None:
            geom = self._add_mesh(body, shape, shape.mesh, is_touched=is_touched)
        else:
            x, y, z = shape.size
            halves = {"box": (x / 2, y / 2, z / 2), "sphere": (x, 0.0, 0.0)}.get(shape.kind, (x, y / 2, 0.0))
            size = tuple(max(half, LEAST_LENGTH) for half in halves)
            geom = body.add_geom(type=_KINDS[shape.kind], size=size, **placed(shape.pose))
        geom.rgba = shape.colour or GREY
        geom.contype = geom.conaffinity = int(is_touched)
        geom.group = 2 if shape.is_seen else 3
        geom.mass = 0.0
        return is_touched

    def extent(self, shapes: Iterable[ModelShape]) -> NDArray[np.float64] | None:
        """Edge lengths (3) [m] of the box around what is touched, along the axes of the link; None where nothing is."""
        bounds = [self._bounds(shape) for shape in shapes if shape.is_touched]
        if not bounds:
            return None
        lower, upper = np.min([each[0] for each in bounds], axis=0), np.max([each[1] for each in bounds], axis=0)
        edges: NDArray[np.float64] = upper - lower
        return edges

    def _bounds(self, shape: ModelShape) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lower and upper corner [m] of the box around a shape's own box, along the axes of the link."""
        if shape.mesh is not None:
            vertices, _ = self._read(shape.mesh, shape.size)
            lower, upper = vertices.min(axis=0), vertices.max(axis=0)
        else:
            x, y, z = shape.size
            halves = {"box": (x / 2, y / 2, z / 2), "sphere": (x, x, x), "cylinder": (x, x, y / 2)}
            upper = np.array(halves.get(shape.kind, (x, x, x + y / 2)))
            lower = -upper
        corners = [shape.pose.transform((x, y, z)) for x, y, z in product(*zip(lower, upper, strict=True))]
        return np.min(corners, axis=0), np.max(corners, axis=0)

    def _add_mesh(self, body: Any, shape: ModelShape, path: Path, *, is_touched: bool) -> Any:
        vertices, triangles = self._read(path, shape.size)
        if len(vertices) < 4 or (is_touched and is_flat(vertices)):
            # the engine finds no hull around it: its box stands for it
            lower, upper = vertices.min(axis=0), vertices.max(axis=0)
            x, y, z = ((lower + upper) / 2).tolist()
            halves = np.maximum((upper - lower) / 2, LEAST_LENGTH)
            at = shape.pose @ Pose((x, y, z))
            return body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=halves, **placed(at))
        key = path, shape.size
        if key not in self._names:
            self._names[key] = f"mesh {len(self._names)} {path.name}"
            add_mesh(self._spec, self._names[key], (vertices, triangles))
        return body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=self._names[key], **placed(shape.pose))

    def _read(self, path: Path, scale: Vector3) -> Mesh:
        """A mesh [m], as large as a shape has it; a mirrored one keeps its outside outside."""
        if path not in self._files:
            self._files[path] = read_mesh(path)
        vertices, triangles = self._files[path]
        return vertices * scale, triangles if np.prod(scale) > 0 else triangles[:, ::-1]


def placed(pose: Pose) -> dict[str, Any]:
    """A pose as the engine's specification takes it."""
    return {"pos": pose.position, "quat": pose.quaternion if pose.quaternion != IDENTITY_QUATERNION else (1, 0, 0, 0)}
