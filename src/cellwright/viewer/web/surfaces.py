"""Triangles for the forms of a scene, with directions that let round things look round."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cellwright.pose import Pose
from cellwright.scene import Form, Mesh, Scene, Shape

Array = NDArray[np.float64]
Faces = NDArray[np.int64]

_CREASE = math.cos(math.radians(38))  # edges sharper than that stay edges
_WIDEST = 30.0
"""Half the side of a plane without end [m]."""
_FINEST, _COARSEST = 48, 12  # corners of a circle
_BEVEL, _MOST_BEVEL = 0.08, 0.004  # share of the least half side; [m]
_LEAST_BEVELLED = 0.004  # [m]: what is thinner than that is a plain box


@dataclass(frozen=True, slots=True)
class Surface:
    """Triangles.

    Attributes:
        points: (n, 3) [m].
        normals: (n, 3) which way the surface faces there, unit vectors.
        faces: (m, 3) indices of points, counterclockwise as seen from outside.
    """

    points: Array
    normals: Array
    faces: Faces

    def placed(self, pose: Pose) -> Surface:
        """The same in the frame in which `pose` is given."""
        turn = _matrix(pose)
        return Surface(self.points @ turn.T + pose.position, self.normals @ turn.T, self.faces)


def surface(shape: Shape, scene: Scene) -> Surface:
    """A shape's surface, in the frame of its body."""
    x, y, z = shape.size
    match shape.form:
        case Form.BOX:
            found = _box(x, y, z)
        case Form.CYLINDER:
            found = _turned([(0, -y), (x, -y), (x, y), (0, y)], _corners(x))
        case Form.SPHERE:
            found = _ball(x, 0.0)
        case Form.CAPSULE:
            found = _ball(x, y)
        case Form.ELLIPSOID:
            found = _ellipsoid(x, y, z)
        case Form.PLANE:
            found = _plane(x or _WIDEST, y or _WIDEST)
        case Form.MESH:
            assert shape.mesh is not None
            found = mesh_surface(scene.meshes[shape.mesh])
    return found.placed(shape.pose)


def joined(surfaces: list[Surface]) -> Surface:
    """Several surfaces as one."""
    firsts = np.cumsum([0, *(len(each.points) for each in surfaces)])
    return Surface(
        np.concatenate([each.points for each in surfaces]),
        np.concatenate([each.normals for each in surfaces]),
        np.concatenate([each.faces + first for each, first in zip(surfaces, firsts, strict=False)]),
    )


def mesh_surface(mesh: Mesh) -> Surface:
    """A mesh's surface; edges that are no creases are made round, as they were meant."""
    corners = mesh.vertices.astype(np.float64)[mesh.faces]  # (faces, 3, 3)
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(areas, axis=1)
    is_real = size > 1e-14
    corners, areas, size = corners[is_real], areas[is_real], size[is_real]
    if not len(corners):
        return Surface(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3), np.int64))
    facing = areas / size[:, None]
    points = corners.reshape(-1, 3)
    _, place = np.unique(np.round(points, 6), axis=0, return_inverse=True)
    place = place.reshape(-1)
    normals = _smooth(place, np.repeat(facing, 3, axis=0), np.repeat(size, 3))
    return Surface(points, normals, np.arange(len(points)).reshape(-1, 3))


def _smooth(place: NDArray[np.intp], facing: Array, weight: Array) -> Array:
    """For each corner: the mean of the faces that meet in its place and are not beyond a crease."""
    order = np.argsort(place, kind="stable")
    counts = np.bincount(place)
    many = counts[place[order]]
    first = (np.cumsum(counts) - counts)[place[order]]
    mine = np.repeat(order, many)
    other = order[np.repeat(first, many) + (np.arange(len(mine)) - np.repeat(np.cumsum(many) - many, many))]
    is_near = (facing[mine] * facing[other]).sum(axis=1) > _CREASE
    total = np.zeros_like(facing)
    np.add.at(total, mine[is_near], (facing[other] * weight[other, None])[is_near])
    length = np.linalg.norm(total, axis=1, keepdims=True)
    found: Array = np.where(length > 0, total / np.maximum(length, 1e-300), facing)
    return found


def _corners(radius: float) -> int:
    return int(min(max(round(220 * math.sqrt(max(radius, 0.0))), _COARSEST), _FINEST) // 4 * 4)


def _turned(outline: list[tuple[float, float]], corners: int) -> Surface:
    """What an outline (radius, height), from below to above, sweeps out about z; each of its edges is a crease."""
    angles = np.linspace(0, 2 * math.pi, corners + 1)
    round_ = np.column_stack([np.cos(angles), np.sin(angles)])
    pieces = []
    for (r0, z0), (r1, z1) in pairwise(outline):
        slope = np.array([z1 - z0, r0 - r1]) / (math.hypot(z1 - z0, r1 - r0) or 1.0)
        pieces.append(_band(round_, (r0, z0), (r1, z1), tuple(slope), tuple(slope)))
    return joined(pieces)


def _band(
    round_: Array,
    low: tuple[float, float],
    high: tuple[float, float],
    facing_low: tuple[float, ...],
    facing_high: tuple[float, ...],
) -> Surface:
    count = len(round_)
    points = np.concatenate([np.column_stack([r * round_, np.full(count, z)]) for r, z in (low, high)])
    normals = np.concatenate(
        [np.column_stack([out * round_, np.full(count, up)]) for out, up in (facing_low, facing_high)]
    )
    here = np.arange(count - 1)
    faces = [np.column_stack([here, here + 1, here + 1 + count])] if low[0] > 0 else []
    faces += [np.column_stack([here, here + 1 + count, here + count])] if high[0] > 0 else []
    return Surface(points, normals, np.concatenate(faces) if faces else np.zeros((0, 3), np.int64))


def _ball(radius: float, half: float) -> Surface:
    """A sphere, or a capsule with `half` the length of its cylinder."""
    corners = _corners(radius)
    angles = np.linspace(0, 2 * math.pi, corners + 1)
    round_ = np.column_stack([np.cos(angles), np.sin(angles)])
    tilts = np.linspace(-math.pi / 2, math.pi / 2, corners // 2 + 1)
    rows = [(math.cos(t), math.sin(t), -half if t <= 0 else half) for t in tilts]
    rows[0], rows[-1] = (0.0, -1.0, -half), (0.0, 1.0, half)
    if half:
        equator = corners // 4
        rows.insert(equator + 1, (1.0, 0.0, half))
        rows[equator] = (1.0, 0.0, -half)
    return joined(
        [
            _band(round_, (radius * c0, radius * s0 + h0), (radius * c1, radius * s1 + h1), (c0, s0), (c1, s1))
            for (c0, s0, h0), (c1, s1, h1) in pairwise(rows)
        ]
    )


def _ellipsoid(x: float, y: float, z: float) -> Surface:
    ball = _ball(1.0, 0.0)
    scale = np.array([x, y, z])
    normals = ball.normals / np.maximum(scale, 1e-9)
    return Surface(ball.points * scale, normals / np.linalg.norm(normals, axis=1, keepdims=True), ball.faces)


def _plane(x: float, y: float) -> Surface:
    points = np.array([(-x, -y, 0.0), (x, -y, 0.0), (x, y, 0.0), (-x, y, 0.0)])
    return Surface(points, np.tile((0.0, 0.0, 1.0), (4, 1)), np.array([(0, 1, 2), (0, 2, 3)]))


def _box(x: float, y: float, z: float) -> Surface:
    """A box; its edges are broken a little, as those of real things are, so that they catch the light."""
    sides = np.array([x, y, z])
    bevel = min(_BEVEL * float(sides.min()), _MOST_BEVEL) if sides.min() > _LEAST_BEVELLED else 0.0
    pieces = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for sign in (-1.0, 1.0):
            corners = np.zeros((4, 3))
            corners[:, axis] = sign * sides[axis]
            corners[:, u] = (sides[u] - bevel) * np.array([-1, 1, 1, -1])
            corners[:, v] = (sides[v] - bevel) * np.array([-1, -1, 1, 1])
            pieces.append(_flat(corners))
            if bevel:  # the edges between this side and the next axis's
                for other in (-1.0, 1.0):
                    edge = np.zeros((4, 3))
                    edge[:, axis] = sign * np.array(
                        [sides[axis], sides[axis], sides[axis] - bevel, sides[axis] - bevel]
                    )
                    edge[:, u] = other * np.array([sides[u] - bevel, sides[u] - bevel, sides[u], sides[u]])
                    edge[:, v] = (sides[v] - bevel) * np.array([-1, 1, 1, -1])
                    pieces.append(_flat(edge))
    if bevel:
        for signs in np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).T.reshape(-1, 3):
            corner = signs * (sides - bevel * (1 - np.eye(3)))
            pieces.append(_flat(corner))
    return joined(pieces)


def _flat(corners: Array) -> Surface:
    """A flat piece of three or four corners in the order around it, that faces away from the origin."""
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    if normal @ corners.mean(axis=0) < 0:
        corners, normal = corners[::-1], -normal
    normal = normal / (np.linalg.norm(normal) or 1.0)
    faces = np.array([(0, 1, 2), (0, 2, 3)][: len(corners) - 2])
    return Surface(corners, np.tile(normal, (len(corners), 1)), faces)


def _matrix(pose: Pose) -> Array:
    return np.column_stack([pose.rotate(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))])
