"""Shapes of a robot's MJCF file, in the frames of its links."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from cellwright.config.models.model import Colour, ModelShape, ModelShapeKind, clipped_colour
from cellwright.config.parsing.tree import Problems
from cellwright.config.robot.mjcf_file import CompiledMjcf
from cellwright.config.robot.model import Link
from cellwright.util.pose import Pose, Vector3, normalized, rotate

_KINDS: Mapping[str, ModelShapeKind] = {
    "box": "box",
    "sphere": "sphere",
    "cylinder": "cylinder",
    "capsule": "capsule",
    "mesh": "mesh",
}
_SHOWN_GROUPS = 3  # the engine's viewers draw the groups 0 to 2 by default
_UNSET = (0.5, 0.5, 0.5, 1.0)  # the engine's default colour of a geom


def pose_at(position: Any, quaternion: Any) -> Pose:
    """Return a pose of the engine's model."""
    x, y, z = map(float, position)
    qw, qx, qy, qz = map(float, quaternion)
    return Pose((x, y, z), (qw, qx, qy, qz))


class ShapeReader:
    """Reader of the geoms of an MJCF file; faults go to `problems`."""

    def __init__(self, mjcf: CompiledMjcf, problems: Problems) -> None:
        self._mjcf, self._problems = mjcf, problems
        self._model = mjcf.model
        self._specs = {mesh.name: mesh for mesh in mjcf.spec.meshes}

    def read(self, body: int, link_T_body: Pose) -> tuple[ModelShape, ...]:
        """Return the shapes of a body: drawn in the groups 0 to 2, touched if its bits allow any contact."""
        first, count = int(self._model.body_geomadr[body]), int(self._model.body_geomnum[body])
        shapes = [self._shape(geom, link_T_body) for geom in range(first, first + count)]
        return tuple(shape for shape in shapes if shape is not None and (shape.is_seen or shape.is_touched))

    def with_seen(self, links: Mapping[str, Link]) -> dict[str, Link]:
        """Return the links; a robot without shapes to draw is drawn by those for contact, as one from a URDF is."""
        if any(shape.is_seen for link in links.values() for shape in link.shapes):
            return dict(links)
        return {
            name: replace(link, shapes=tuple(replace(shape, is_seen=True) for shape in link.shapes))
            for name, link in links.items()
        }

    def _shape(self, geom: int, link_T_body: Pose) -> ModelShape | None:
        model = self._model
        kind = self._mjcf.kind("mjtGeom", model.geom_type[geom])
        if kind not in _KINDS:
            message = f"a robot has no shape of this type (got {kind}); use one of {', '.join(_KINDS)}"
            self._problems.error(self._mjcf.element("geom", geom), message)
            return None
        pose = link_T_body @ pose_at(model.geom_pos[geom], model.geom_quat[geom])
        red, green, blue, opacity = colour = self._colour(geom)
        x, y, z = map(float, model.geom_size[geom])
        size: Vector3 = {"box": (2 * x, 2 * y, 2 * z), "sphere": (x, 0.0, 0.0)}.get(kind, (x, 2 * y, 0.0))
        mesh = None
        if kind == "mesh":
            number = int(model.geom_dataid[geom])
            name = model.mesh(number).name
            placed = self._mesh(name, geom)
            if placed is None:
                return None
            # the engine moves a mesh into its principal axes, and its geom to where it was
            centred_T_file = pose_at(model.mesh_pos[number], model.mesh_quat[number]).inverse()
            pose, size, mesh = pose @ centred_T_file @ placed[0], placed[1], self._mjcf.meshes[name]
        return ModelShape(
            kind=_KINDS[kind],
            size=size,
            pose=pose,
            colour=None if (red, green, blue, opacity) == _UNSET else colour,
            is_touched=bool(model.geom_contype[geom] or model.geom_conaffinity[geom]),
            is_seen=int(model.geom_group[geom]) < _SHOWN_GROUPS and opacity > 0,
            mesh=mesh,
        )

    def _colour(self, geom: int) -> Colour:
        """Return the geom's own colour, else that of its material."""
        model, material = self._model, int(self._model.geom_matid[geom])
        own = tuple(float(share) for share in model.geom_rgba[geom])
        is_own = material < 0 or any(share != np.float32(unset) for share, unset in zip(own, _UNSET, strict=True))
        # the engine's numbers have single precision: 0.1 is written as 0.1 again
        return clipped_colour([float(f"{share:.6g}") for share in (own if is_own else model.mat_rgba[material])])

    def _mesh(self, name: str, geom: int) -> tuple[Pose, Vector3] | None:
        """Return where a mesh's file lies in its asset, and its scale.

        A vertex v becomes S R^-1 (v - p), with the scale S, the reference position p [m] and orientation R. That is a
        pose after a scale only if S and R change places: if S is the same for all axes, or R is none.
        """
        spec = self._specs[name]
        sx, sy, sz = scale = tuple(map(float, spec.scale))
        px, py, pz = map(float, spec.refpos)
        qw, qx, qy, qz = map(float, spec.refquat)
        qw, qx, qy, qz = normalized((qw, qx, qy, qz))
        is_turned = max(abs(qx), abs(qy), abs(qz)) > 1e-9
        if is_turned and len(set(scale)) > 1:
            message = f"mesh {name!r} has a refquat and a scale of its own for each axis; apply one of them to its file"
            self._problems.error(self._mjcf.element("geom", geom), message)
            return None
        turn = (qw, -qx, -qy, -qz)
        x, y, z = rotate(turn, (px, py, pz))
        return Pose((-sx * x, -sy * y, -sz * z), turn), (sx, sy, sz)
