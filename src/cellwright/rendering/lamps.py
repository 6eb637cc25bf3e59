"""The light in a picture: one bright lamp with a soft edge, and a sky that fills the corners less than the open.

Both are groups of point lamps. Asking every lamp about every pixel would cost too much, so neighbouring pixels ask
different lamps of a group, in a repeating square, and then share what they learned with those neighbours that lie on
the same surface (interleaved sampling: Keller and Heidrich, 2001).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cellwright.rendering.raycast import Hits, RayCaster
from cellwright.util.pose import Vector3

_GOLDEN_ANGLE = math.pi * (3 - math.sqrt(5))
_SAME_SURFACE = 0.9  # smallest cosine between the normals of neighbours that share
_SIDE = 5  # of the square of pixels that share the lamps of a group


@dataclass(frozen=True, slots=True)
class LampGroup:
    """Point lamps that together make one soft light.

    Attributes:
        positions: (side * side, 3) [m], world frame.
        side: side of the square of pixels that share the lamps among them; odd.
    """

    positions: NDArray[np.float64]
    side: int

    @property
    def centre(self) -> NDArray[np.float64]:
        """The mean of the positions (3,) [m]."""
        middle: NDArray[np.float64] = self.positions.mean(axis=0)
        return middle


def disc_lamp(centre: Vector3, towards: Vector3, radius: float, side: int = _SIDE) -> LampGroup:
    """A round lamp of `radius` [m] at `centre` [m], facing the point `towards` [m]."""
    axis = np.subtract(towards, centre, dtype=np.float64)
    axis /= np.linalg.norm(axis)
    across = np.cross(axis, (1.0, 0.0, 0.0) if abs(axis[0]) < 0.9 else (0.0, 1.0, 0.0))
    across /= np.linalg.norm(across)
    upward = np.cross(axis, across)
    count = side * side
    index = np.arange(count)
    reach = radius * np.sqrt((index + 0.5) / count)
    angle = index * _GOLDEN_ANGLE
    offsets = reach[:, None] * (np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * upward)
    return LampGroup(np.asarray(centre) + _scattered(offsets), side)


def sky(centre: Vector3, distance: float, side: int = _SIDE) -> LampGroup:
    """Lamps all over the upper half of a sphere of radius `distance` [m] about `centre` [m]."""
    count = side * side
    index = np.arange(count)
    height = (index + 0.5) / count
    angle = index * _GOLDEN_ANGLE
    flat = np.sqrt(1 - height * height)
    directions = np.column_stack([flat * np.cos(angle), flat * np.sin(angle), height])
    return LampGroup(np.asarray(centre) + distance * _scattered(directions), side)


def _scattered(lamps: NDArray[np.float64]) -> NDArray[np.float64]:
    """The lamps in an order in which those of neighbouring pixels lie far apart (a step prime to their number)."""
    count = len(lamps)
    step = next(s for s in range(max(2, round(count * 0.38)), 2 * count + 1) if math.gcd(s, count) == 1)
    return lamps[np.arange(count) * step % count]


def openness(
    caster: RayCaster, lamps: LampGroup, hits: Hits, points: NDArray[np.float64], rows: range, width: int
) -> NDArray[np.float32]:
    """How much of a group of lamps each pixel's surface sees, of what it would see if nothing stood in the way.

    Args:
        caster: the cell.
        lamps: the group.
        hits: what the pixels show, row by row (len(rows) * width).
        points: where (len(rows) * width, 3) [m].
        rows: which rows of the picture these are; which pixel asks which lamp depends on its place in the picture.
        width: of the picture, in pixels.

    Returns:
        (len(rows) * width,) in 0..1; 0 where the surface faces away from the lamps, and where there is none.
    """
    side = lamps.side
    shape = (len(rows), width)
    chosen = np.add.outer(np.array(rows) % side * side, np.arange(width) % side).reshape(-1)
    facing = np.zeros(len(chosen), np.float32)
    seen = np.zeros(len(chosen), np.float32)
    for number, lamp in enumerate(lamps.positions):
        at = np.flatnonzero((chosen == number) & (hits.geom >= 0))
        towards = lamp - points[at]
        cosine = np.einsum("ij,ij->i", towards, hits.normal[at]) / np.sqrt(np.einsum("ij,ij->i", towards, towards))
        at, cosine = at[cosine > 0], cosine[cosine > 0]
        facing[at] = cosine
        seen[at] = cosine * caster.reaches(lamp, points[at])
    facing, seen = _shared(facing.reshape(shape), seen.reshape(shape), hits, side // 2)
    facing, seen = _shared(facing, seen, hits, 1)  # rounds off what is left of the squares
    return np.divide(seen, facing, out=np.zeros_like(seen), where=facing > 0).reshape(-1)


def _shared(
    facing: NDArray[np.float32], seen: NDArray[np.float32], hits: Hits, reach: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Both pictures (height, width), each pixel summed with its neighbours up to `reach` away on the same surface."""
    height, width = facing.shape
    geom = hits.geom.reshape(height, width)
    normal = hits.normal.astype(np.float32).reshape(height, width, 3)
    facing_sum, seen_sum = facing.copy(), seen.copy()
    for down in range(reach + 1):
        for right in range(-reach, reach + 1):
            if (down, right) <= (0, 0):
                continue  # of every pair of neighbours once
            here = (slice(0, height - down), slice(max(0, -right), width - max(0, right)))
            there = (slice(down, height), slice(max(0, right), width + min(0, right)))
            same = geom[here] == geom[there]
            same &= np.einsum("ijk,ijk->ij", normal[here], normal[there]) > _SAME_SURFACE
            for total, part in ((facing_sum, facing), (seen_sum, seen)):
                total[here] += same * part[there]
                total[there] += same * part[here]
    return facing_sum, seen_sum
