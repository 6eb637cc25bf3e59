"""The forms of a scene as triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cellwright.pose import Vector3
from cellwright.rendering.gl.normals import soft_normals
from cellwright.scene import Form, Scene, Shape

ENDLESS = 60.0
"""Half the side [m] of a plane without end: far beyond where haze has swallowed it."""

_COARSE, _FINE = 20, 48  # sides of a round thing
_LARGE = 0.15  # [m], radius above which it has the more of them


@dataclass(frozen=True, slots=True)
class Triangles:
    """A surface.

    Attributes:
        points: (n, 3) corners [m].
        normals: (n, 3) of unit length, outward.
        faces: (m, 3) indices of corners.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    faces: NDArray[np.int64]


def triangles(shape: Shape, scene: Scene) -> Triangles:
    """The surface of a shape of a scene, in the frame of its body."""
    radius, second, third = shape.size
    match shape.form:
        case Form.PLANE:
            local = _plane(radius or ENDLESS, second or ENDLESS)
        case Form.BOX:
            local = _box(shape.size)
        case Form.SPHERE:
            local = _ball((radius, radius, radius), 0.0)
        case Form.ELLIPSOID:
            local = _ball((radius, second, third), 0.0)
        case Form.CAPSULE:
            local = _ball((radius, radius, radius), second)
        case Form.CYLINDER:
            local = _cylinder(radius, second)
        case Form.MESH:
            assert shape.mesh is not None
            mesh = scene.meshes[shape.mesh]
            local = _mesh(mesh.vertices.astype(np.float64), mesh.faces.astype(np.int64))
    turn = _matrix(shape.pose.quaternion)
    return Triangles(local.points @ turn.T + np.array(shape.pose.position), local.normals @ turn.T, local.faces)


def _plane(half_x: float, half_y: float) -> Triangles:
    points = np.array([(x * half_x, y * half_y, 0.0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    return Triangles(points, np.tile((0.0, 0.0, 1.0), (4, 1)), np.array([(0, 1, 2), (0, 2, 3)]))


def _box(half: Vector3) -> Triangles:
    points, normals = [], []
    for axis in range(3):
        for side in (-1.0, 1.0):
            normal = np.zeros(3)
            normal[axis] = side
            u, v = np.eye(3)[(axis + 1) % 3], side * np.eye(3)[(axis + 2) % 3]
            points += [normal - u - v, normal + u - v, normal + u + v, normal - u + v]
            normals += [normal] * 4
    faces = [(4 * each + a, 4 * each + b, 4 * each + c) for each in range(6) for a, b, c in ((0, 1, 2), (0, 2, 3))]
    return Triangles(np.array(points) * np.array(half), np.array(normals), np.array(faces))


def _cylinder(radius: float, half: float) -> Triangles:
    count = _sides(radius)
    round_ = _circle(count)
    side = np.repeat(round_, 2, axis=0)
    side_points = side * radius
    side_points[0::2, 2], side_points[1::2, 2] = -half, half
    a = 2 * np.arange(count)
    b = 2 * ((np.arange(count) + 1) % count)
    faces = [np.column_stack([a, b, b + 1]), np.column_stack([a, b + 1, a + 1])]
    points, normals = [side_points], [side]
    fan = np.column_stack([np.zeros(count - 2, int), np.arange(1, count - 1), np.arange(2, count)])
    for number, end in enumerate((-1.0, 1.0)):
        points.append(round_ * radius + (0, 0, end * half))
        normals.append(np.tile((0.0, 0.0, end), (count, 1)))
        faces.append((fan if end > 0 else fan[:, ::-1]) + (2 + number) * count)
    return Triangles(np.concatenate(points), np.concatenate(normals), np.concatenate(faces))


def _ball(radii: Vector3, half: float) -> Triangles:
    """An ellipsoid; one that is drawn apart at its equator by `half` [m] to either side is a capsule."""
    count = _sides(max(radii))
    rings = count // 4
    up = np.linspace(0.0, np.pi / 2, rings + 1)
    heights = np.concatenate([-up[::-1], up])  # the equator twice
    round_ = _circle(count)
    unit = np.concatenate([round_ * np.cos(height) + (0, 0, np.sin(height)) for height in heights])
    points = unit * np.array(radii)
    points[:, 2] += np.where(np.arange(len(points)) < (rings + 1) * count, -half, half)
    normals = unit / np.array(radii)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    here = (np.arange(len(heights) - 1)[:, None] * count + np.arange(count)).reshape(-1)
    right = (np.arange(len(heights) - 1)[:, None] * count + (np.arange(count) + 1) % count).reshape(-1)
    faces = np.concatenate(
        [np.column_stack([here, right, right + count]), np.column_stack([here, right + count, here + count])]
    )
    return Triangles(points, normals, faces)


def _mesh(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> Triangles:
    corners = vertices[faces.reshape(-1)]
    return Triangles(corners, soft_normals(vertices, faces), np.arange(len(corners)).reshape(-1, 3))


def _circle(count: int) -> NDArray[np.float64]:
    angle = np.arange(count) * (2 * np.pi / count)
    return np.column_stack([np.cos(angle), np.sin(angle), np.zeros(count)])


def _sides(radius: float) -> int:
    return _FINE if radius > _LARGE else _COARSE


def _matrix(quaternion: tuple[float, float, float, float]) -> NDArray[np.float64]:
    w, x, y, z = np.array(quaternion) / np.linalg.norm(quaternion)
    return np.array(
        [
            (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
            (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
            (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
        ]
    )
