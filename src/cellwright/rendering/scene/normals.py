"""Normals of a mesh: smooth where it is round, sharp where it has an edge."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

_CREASE = math.cos(math.radians(38))  # edges sharper than that stay edges
_MOST = 48  # faces at a vertex of which all pairs are looked at; where more meet, as at the tip of a cone, each is flat


def soft_normals(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """A normal (3 m, 3) of unit length for each corner of each face.

    It is the mean of those faces around the corner that are turned much as its own is, larger ones counting more.

    Args:
        vertices: (n, 3).
        faces: (m, 3), counterclockwise as seen from outside.
    """
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    weighted = np.cross(b - a, c - a)
    length = np.linalg.norm(weighted, axis=1, keepdims=True)
    flat = np.divide(weighted, length, out=np.tile((0.0, 0.0, 1.0), (len(faces), 1)), where=length > 0)

    # Files often hold a vertex once for each face: those in the same place count as one.
    _, place = np.unique(np.round(vertices, 6), axis=0, return_inverse=True)
    at = place.reshape(-1)[faces.reshape(-1)]
    order = np.argsort(at, kind="stable")
    first = np.searchsorted(at[order], at, side="left")
    count = np.searchsorted(at[order], at, side="right") - first
    count[count > _MOST] = 0

    mine = np.repeat(np.arange(len(at)), count)
    within = np.arange(len(mine)) - np.repeat(np.cumsum(count) - count, count)
    other = order[np.repeat(first, count) + within] // 3
    is_alike = np.einsum("ij,ij->i", flat[mine // 3], flat[other]) > _CREASE
    total = np.zeros((len(at), 3))
    np.add.at(total, mine[is_alike], weighted[other[is_alike]])
    size = np.linalg.norm(total, axis=1, keepdims=True)
    own = np.repeat(flat, 3, axis=0)
    return np.where(size > 0, total / np.where(size > 0, size, 1.0), own)
