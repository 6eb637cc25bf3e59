"""Boxes as triangles. Their edges may be broken a little, as those of real things are, so that they catch the light."""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.scene.triangles import Triangles
from cellwright.util.pose import Vector3

_BEVEL, _MOST_BEVEL = 0.08, 0.004  # share of the least half side; [m]
_LEAST_BEVELLED = 0.004  # [m]: what is thinner than that is a plain box

_Corner = tuple[dict[int, int], int]
"""In which octant a corner is, as a sign for each axis, and on the side of which axis: broken, it is three corners."""


def box(half: Vector3, *, breaks_edges: bool) -> Triangles:
    """A box of these half sides [m]."""
    least = min(half)
    bevel = min(_BEVEL * least, _MOST_BEVEL) if breaks_edges and least > _LEAST_BEVELLED else 0.0
    octants, set_back, normals, faces = _pattern(is_broken=bevel > 0)
    return Triangles(octants * np.array(half) - bevel * set_back, normals, faces)


@cache
def _pattern(
    *, is_broken: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """What boxes of any size have in common: octants of their corners, whither these are set back, normals, faces."""
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
    """The flat pieces of a box, each as its corners in the order around it, one way or the other."""
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
