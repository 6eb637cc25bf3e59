"""Triangle meshes of a scene's shapes, with smooth normals and bevelled boxes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.scene.scene import Mesh, Scene, SceneShape, ShapeType
from cellwright.util.pose import Pose, Vector3

_CREASE = math.cos(math.radians(38))  # sharper edges stay edges
# At a vertex with more faces, such as the tip of a cone, pairs are not compared, and each face is flat.
_MAX_FACES = 48
_BEVEL, _MAX_BEVEL = 0.08, 0.004  # share of the smallest half side; [m]
_MIN_BEVELLED = 0.004  # [m]: a thinner box has no bevel
_NO_AREA = 1e-14  # [m²]
_ENDLESS = 30.0  # [m], half the side of an endless plane


@dataclass(frozen=True, slots=True)
class Triangles:
    """Surface: corners (n, 3) [m], outward normals there, and faces (m, 3), counterclockwise from outside."""

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    faces: NDArray[np.int64]

    def placed(self, pose: Pose) -> Triangles:
        """Transform to the frame in which `pose` is given."""
        turn = np.array([pose.rotate(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))])
        return Triangles(self.points @ turn + np.array(pose.position), self.normals @ turn, self.faces)


def join_triangles(surfaces: Iterable[Triangles]) -> Triangles:
    """Join several surfaces into one."""
    found = list(surfaces)
    firsts = np.cumsum([0, *(len(each.points) for each in found)])
    return Triangles(
        np.concatenate([each.points for each in found]),
        np.concatenate([each.normals for each in found]),
        np.concatenate([each.faces + first for each, first in zip(found, firsts, strict=False)]),
    )


def soft_normals(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return a unit normal (3 m, 3) for each corner of each face.

    It is the mean over the faces at the corner with a similar normal, weighted by their area.
    """
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    weighted = np.cross(b - a, c - a)
    length = np.linalg.norm(weighted, axis=1, keepdims=True)
    flat = np.divide(weighted, length, out=np.tile((0.0, 0.0, 1.0), (len(faces), 1)), where=length > 0)

    # Files often repeat a vertex for each face: vertices at the same place count as one.
    _, place = np.unique(np.round(vertices, 6), axis=0, return_inverse=True)
    at = place.reshape(-1)[faces.reshape(-1)]
    order = np.argsort(at, kind="stable")
    first = np.searchsorted(at[order], at, side="left")
    count = np.searchsorted(at[order], at, side="right") - first
    count[count > _MAX_FACES] = 0

    members = np.repeat(np.arange(len(at)), count)
    within = np.arange(len(members)) - np.repeat(np.cumsum(count) - count, count)
    other = order[np.repeat(first, count) + within] // 3
    is_alike = np.einsum("ij,ij->i", flat[members // 3], flat[other]) > _CREASE
    total = np.zeros((len(at), 3))
    np.add.at(total, members[is_alike], weighted[other[is_alike]])
    size = np.linalg.norm(total, axis=1, keepdims=True)
    own = np.repeat(flat, 3, axis=0)
    return np.where(size > 0, total / np.where(size > 0, size, 1.0), own)


_Corner = tuple[dict[int, int], int]
"""Octant of a corner, as a sign per axis, and the axis of its side: a bevelled corner is three corners."""


def box_triangles(half: Vector3) -> Triangles:
    """Return a box with these half sides [m]; unless it is thin, small bevels make its edges catch the light."""
    smallest = min(half)
    bevel = min(_BEVEL * smallest, _MAX_BEVEL) if smallest > _MIN_BEVELLED else 0.0
    octants, set_back, normals, faces = _pattern(is_broken=bevel > 0)
    return Triangles(octants * np.array(half) - bevel * set_back, normals, faces)


@cache
def _pattern(
    *, is_broken: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Return the pattern of all boxes: octants of the corners, directions of their bevels, normals, faces."""
    octants, set_back, normals, faces, count = [], [], [], [], 0
    for piece in _pieces(is_broken=is_broken):
        signs = np.array([[octant[axis] for axis in range(3)] for octant, _ in piece], np.float64)
        side = np.eye(3)[[axis for _, axis in piece]]
        normal = (signs * side).sum(axis=0)
        points = signs - 0.1 * signs * (1 - side)
        if np.cross(points[1] - points[0], points[2] - points[0]) @ normal < 0:
            signs, side = signs[::-1], side[::-1]
        octants.append(signs)
        set_back.append(signs * (1 - side))
        normals.append(np.tile(normal / np.linalg.norm(normal), (len(piece), 1)))
        faces += [(count, count + other, count + other + 1) for other in range(1, len(piece) - 1)]
        count += len(piece)
    return np.concatenate(octants), np.concatenate(set_back), np.concatenate(normals), np.array(faces)


def _pieces(*, is_broken: bool) -> list[list[_Corner]]:
    """Flat pieces of a box, each as its corners in order around it, in either direction."""
    pieces: list[list[_Corner]] = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        around = ((-1, -1), (1, -1), (1, 1), (-1, 1))
        pieces += [[({axis: side, u: at_u, v: at_v}, axis) for at_u, at_v in around] for side in (-1, 1)]
        if is_broken:  # edges along this axis
            for at_u, at_v in around:
                low, high = ({axis: end, u: at_u, v: at_v} for end in (-1, 1))
                pieces.append([(low, u), (low, v), (high, v), (high, u)])
    if is_broken:
        pieces += [[(dict(enumerate(octant)), axis) for axis in range(3)] for octant in product((-1, 1), repeat=3)]
    return pieces


def shape_triangles(shape: SceneShape, scene: Scene, corners: Callable[[float], int]) -> Triangles:
    """Return the surface of a shape of a scene, in the frame of its body.

    `corners` returns the number of corners of a circle for its radius [m], a multiple of 4.
    """
    x, y, z = shape.size
    match shape.form:
        case ShapeType.BOX:
            found = box_triangles((x, y, z))
        case ShapeType.CYLINDER:
            found = _cylinder(x, y, corners(x))
        case ShapeType.SPHERE:
            found = _ball((x, x, x), 0.0, corners(x))
        case ShapeType.CAPSULE:
            found = _ball((x, x, x), y, corners(x))
        case ShapeType.ELLIPSOID:
            found = _ball((x, y, z), 0.0, corners(max(x, y, z)))
        case ShapeType.PLANE:
            found = _plane(x or _ENDLESS, y or _ENDLESS)
        case ShapeType.MESH:
            assert shape.mesh is not None
            found = mesh_triangles(scene.meshes[shape.mesh])
    return found.placed(shape.pose)


def mesh_triangles(mesh: Mesh) -> Triangles:
    """Return a mesh's surface, without degenerate faces, and smooth at edges that are no creases."""
    vertices, faces = mesh.vertices.astype(np.float64), mesh.faces.astype(np.int64)
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    faces = faces[np.linalg.norm(np.cross(b - a, c - a), axis=1) > _NO_AREA]
    points = vertices[faces.reshape(-1)]
    return Triangles(points, soft_normals(vertices, faces), np.arange(len(points)).reshape(-1, 3))


def _plane(x: float, y: float) -> Triangles:
    points = np.array([(-x, -y, 0.0), (x, -y, 0.0), (x, y, 0.0), (-x, y, 0.0)])
    return Triangles(points, np.tile((0.0, 0.0, 1.0), (4, 1)), np.array([(0, 1, 2), (0, 2, 3)]))


def _cylinder(radius: float, half: float, corners: int) -> Triangles:
    below, above = (0.0, -1.0), (0.0, 1.0)
    side = (1.0, 0.0)
    return join_triangles(
        [
            _swept([(0.0, -half), (radius, -half)], [below, below], corners),
            _swept([(radius, -half), (radius, half)], [side, side], corners),
            _swept([(radius, half), (0.0, half)], [above, above], corners),
        ]
    )


def _ball(radii: Vector3, half: float, corners: int) -> Triangles:
    """Ellipsoid; with its halves moved apart by `half` [m] each, a capsule."""
    tilts = np.linspace(0.0, np.pi / 2, corners // 4 + 1)
    tilts = np.concatenate([-tilts[::-1], tilts if half else tilts[1:]])  # a capsule has the equator twice
    outline = [*zip(np.cos(tilts).tolist(), np.sin(tilts).tolist(), strict=True)]
    outline[0], outline[-1] = (0.0, -1.0), (0.0, 1.0)
    unit = _swept(outline, outline, corners)
    points = unit.points * np.array(radii)
    if half:
        points[:, 2] += np.where(np.arange(len(points)) < len(points) // 2, -half, half)
    normals = unit.normals / np.maximum(np.array(radii), 1e-9)
    return Triangles(points, normals / np.linalg.norm(normals, axis=1, keepdims=True), unit.faces)


def _swept(outline: Sequence[tuple[float, float]], facing: Sequence[tuple[float, float]], corners: int) -> Triangles:
    """Sweep an outline of (radius, height) [m], from below to above, with normals (outwards, up), around the z axis."""
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
        np.concatenate(points), np.concatenate(normals), np.concatenate(faces) if faces else np.zeros((0, 3), np.int64)
    )
