"""Joining of a scene's shapes into few meshes: OpenGL draws those faster than many small shapes."""

import math
from dataclasses import replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.scene.scene import SEEN, Mesh, Scene, SceneShape, ShapeLayer, ShapeType
from cellwright.rendering.scene.triangles import shape_triangles
from cellwright.util.pose import Pose

_TILE = 4.0  # [m], side of the squares of the floor whose static shapes are joined: a camera sees few of them
_CORNERS = ((0.005, 8), (0.01, 12), (0.02, 16), (0.1, 24), (math.inf, 32))
"""Corners of circles up to a radius [m]; their edges are at most 0.9 mm, or 0.5 % of it, too far inside."""

_Points: TypeAlias = NDArray[np.float32]
_Faces: TypeAlias = NDArray[np.int32]


def join_shapes(scene: Scene) -> Scene:
    """Return a scene that looks the same, with one mesh for the opaque shapes of a body that have the same colour.

    Static shapes are also separated by their place. Equal meshes are shared. Planes and translucent shapes stay as they
    are, and shapes that are not seen are left out.
    """
    kept: list[SceneShape] = []
    groups: dict[tuple[object, ...], list[SceneShape]] = {}
    for shape in scene.shapes:
        if shape.layer not in SEEN:
            continue
        if shape.form is ShapeType.PLANE or shape.colour[3] < 1:
            kept.append(shape)
            continue
        x, y, _ = shape.pose.position
        place = (x // _TILE, y // _TILE) if shape.body == 0 else ()
        groups.setdefault((shape.body, shape.colour, place), []).append(shape)
    meshes, numbers = [*scene.meshes], dict[tuple[bytes, bytes], int]()
    for group in groups.values():
        points, faces = _joined([_surface(shape, scene) for shape in group])
        number = numbers.setdefault((points.tobytes(), faces.tobytes()), len(meshes))
        if number == len(meshes):
            meshes.append(Mesh(points, faces))
        first = group[0]
        kept.append(
            SceneShape(first.body, ShapeType.MESH, (0.0, 0.0, 0.0), Pose(), first.colour, ShapeLayer.LOOKS, number)
        )
    return _without_unused_meshes(replace(scene, shapes=tuple(kept), meshes=tuple(meshes)))


def _surface(shape: SceneShape, scene: Scene) -> tuple[_Points, _Faces]:
    """Return the triangles of a shape, in the frame of its body."""
    if shape.mesh is None:
        found = shape_triangles(shape, scene, _corners)
        return found.points.astype(np.float32), found.faces.astype(np.int32)
    mesh = scene.meshes[shape.mesh]
    turn = np.array([shape.pose.rotate(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))])
    return (mesh.vertices @ turn + np.array(shape.pose.position)).astype(np.float32), mesh.faces


def _corners(radius: float) -> int:
    return next(count for limit, count in _CORNERS if radius <= limit)


def _joined(surfaces: list[tuple[_Points, _Faces]]) -> tuple[_Points, _Faces]:
    firsts = np.cumsum([0, *(len(points) for points, _ in surfaces)], dtype=np.int32)
    faces = [faces + first for (_, faces), first in zip(surfaces, firsts, strict=False)]
    return np.concatenate([points for points, _ in surfaces]), np.concatenate(faces)


def _without_unused_meshes(scene: Scene) -> Scene:
    used = sorted({shape.mesh for shape in scene.shapes if shape.mesh is not None})
    index = {old: new for new, old in enumerate(used)}
    shapes = (shape if shape.mesh is None else replace(shape, mesh=index[shape.mesh]) for shape in scene.shapes)
    return replace(scene, shapes=tuple(shapes), meshes=tuple(scene.meshes[each] for each in used))
