"""The forms of a scene as triangles, with directions that let round things look round."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cellwright.rendering.scene.boxes import box
from cellwright.rendering.scene.normals import soft_normals
from cellwright.rendering.scene.scene import Form, Mesh, Scene, Shape
from cellwright.rendering.scene.triangles import Fineness, Triangles, joined
from cellwright.util.pose import Vector3

_NO_AREA = 1e-14  # [m²]


def triangles(shape: Shape, scene: Scene, fineness: Fineness) -> Triangles:
    """The surface of a shape of a scene, in the frame of its body."""
    x, y, z = shape.size
    match shape.form:
        case Form.BOX:
            found = box((x, y, z), breaks_edges=fineness.breaks_edges)
        case Form.CYLINDER:
            found = _cylinder(x, y, fineness.corners(x))
        case Form.SPHERE:
            found = _ball((x, x, x), 0.0, fineness.corners(x))
        case Form.CAPSULE:
            found = _ball((x, x, x), y, fineness.corners(x))
        case Form.ELLIPSOID:
            found = _ball((x, y, z), 0.0, fineness.corners(max(x, y, z)))
        case Form.PLANE:
            found = _plane(x or fineness.endless, y or fineness.endless)
        case Form.MESH:
            assert shape.mesh is not None
            found = mesh_triangles(scene.meshes[shape.mesh])
    return found.placed(shape.pose)


def mesh_triangles(mesh: Mesh) -> Triangles:
    """A mesh's surface, without what has no extent; edges that are no creases are made round, as they were meant."""
    vertices, faces = mesh.vertices.astype(np.float64), mesh.faces.astype(np.int64)
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    faces = faces[np.linalg.norm(np.cross(b - a, c - a), axis=1) > _NO_AREA]
    points = vertices[faces.reshape(-1)]
    return Triangles(points, soft_normals(vertices, faces), np.arange(len(points)).reshape(-1, 3))


def _plane(x: float, y: float) -> Triangles:
    points = np.array([(-x, -y, 0.0), (x, -y, 0.0), (x, y, 0.0), (-x, y, 0.0)])
    return Triangles(points, np.tile((0.0, 0.0, 1.0), (4, 1)), np.array([(0, 1, 2), (0, 2, 3)]))


# -------------------------------------------------------------------- what is round about z


def _cylinder(radius: float, half: float, corners: int) -> Triangles:
    below, above = (0.0, -1.0), (0.0, 1.0)
    side = (1.0, 0.0)
    return joined(
        [
            _swept([(0.0, -half), (radius, -half)], [below, below], corners),
            _swept([(radius, -half), (radius, half)], [side, side], corners),
            _swept([(radius, half), (0.0, half)], [above, above], corners),
        ]
    )


def _ball(radii: Vector3, half: float, corners: int) -> Triangles:
    """An ellipsoid; one that is drawn apart at its equator by `half` [m] to either side is a capsule."""
    tilts = np.linspace(0.0, np.pi / 2, corners // 4 + 1)
    tilts = np.concatenate([-tilts[::-1], tilts if half else tilts[1:]])  # of a capsule the equator is there twice
    outline = [*zip(np.cos(tilts).tolist(), np.sin(tilts).tolist(), strict=True)]
    outline[0], outline[-1] = (0.0, -1.0), (0.0, 1.0)
    unit = _swept(outline, outline, corners)
    points = unit.points * np.array(radii)
    if half:
        points[:, 2] += np.where(np.arange(len(points)) < len(points) // 2, -half, half)
    normals = unit.normals / np.maximum(np.array(radii), 1e-9)
    return Triangles(points, normals / np.linalg.norm(normals, axis=1, keepdims=True), unit.faces)


def _swept(outline: Sequence[tuple[float, float]], facing: Sequence[tuple[float, float]], corners: int) -> Triangles:
    """What an outline of (radius, height) [m], from below to above, sweeps out; it faces (outwards, up) at each."""
    angle = np.arange(corners) * (2 * np.pi / corners)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    points = [np.column_stack([radius * circle, np.full(corners, height)]) for radius, height in outline]
    normals = [np.column_stack([out * circle, np.full(corners, up)]) for out, up in facing]
    here = np.arange(corners)
    right = (here + 1) % corners
    faces = []
    for row in range(len(outline) - 1):
        low, high = row * corners, (row + 1) * corners
        if outline[row][0] > 0:
            faces.append(np.column_stack([low + here, low + right, high + right]))
        if outline[row + 1][0] > 0:
            faces.append(np.column_stack([low + here, high + right, high + here]))
    return Triangles(
        np.concatenate(points),
        np.concatenate(normals),
        np.concatenate(faces) if faces else np.zeros((0, 3), np.int64),
    )
