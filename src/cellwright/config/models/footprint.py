"""What parts cover of the plane they lie on, and how far apart they are there."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import TypeAlias

from cellwright.config.layout import PART_FOOTPRINTS, PART_RADII, Piece
from cellwright.util.pose import Pose

Point: TypeAlias = tuple[float, float]

UNKNOWN_RADIUS = 0.1
"""Radius [m] of the disc that stands for a part of which only the place is known."""

_FLAT = 0.999
"""Vertical share of the part's z axis from which on it lies flat, either way up: 2.6 degrees."""


@dataclass(frozen=True, slots=True)
class Patch:
    """A convex piece of a footprint in the world: all points within `radius` [m] of the hull of `corners` [m]."""

    corners: tuple[Point, ...]
    radius: float

    def span(self, nx: float, ny: float) -> tuple[float, float]:
        """The least and the most of it along a unit vector [m]."""
        along = [x * nx + y * ny for x, y in self.corners]
        return min(along) - self.radius, max(along) + self.radius


@dataclass(frozen=True, slots=True)
class Footprint:
    """What a part covers, made of convex patches; all of it is within `radius` [m] of `centre` [m]."""

    centre: Point
    radius: float
    patches: tuple[Patch, ...]

    def gap(self, other: Footprint, enough: float) -> float:
        """The distance to another footprint [m], negative when they overlap.

        Distances above `enough` are not told apart: any number above it may be returned.
        """
        far = math.dist(self.centre, other.centre) - self.radius - other.radius
        if far > enough:
            return far
        return min(_gap(a, b) for a, b in product(self.patches, other.patches))

    def margin(self, centre: Point, half: float) -> float:
        """How far inside a square about `centre` with edges 2 `half` along the axes it stays [m]; negative outside."""
        spans = [(patch.span(1.0, 0.0), patch.span(0.0, 1.0)) for patch in self.patches]
        return half - max(max(centre[0] - x[0], x[1] - centre[0], centre[1] - y[0], y[1] - centre[1]) for x, y in spans)


def footprint(part_type: str, world_T_part: Pose) -> Footprint:
    """What a part covers where it is.

    A part that lies flat, either way up, covers what its shapes do; one that is tilted may cover all within its radius,
    and one of a type that the layout does not know all within `UNKNOWN_RADIUS`.
    """
    x, y, _ = world_T_part.position
    radius = PART_RADII.get(part_type, UNKNOWN_RADIUS)
    pieces = PART_FOOTPRINTS.get(part_type)
    if pieces is None or abs(world_T_part.rotate((0.0, 0.0, 1.0))[2]) < _FLAT:
        return Footprint((x, y), radius, (Patch(((x, y),), radius),))
    return Footprint((x, y), radius, tuple(_patch(piece, world_T_part) for piece in pieces))


def _patch(piece: Piece, world_T_part: Pose) -> Patch:
    x, y, a, b, radius = piece
    local = sorted({(x + sx * a, y + sy * b, 0.0) for sx in (1, -1) for sy in (1, -1)})
    seen = [world_T_part.transform(point) for point in local]
    return Patch(tuple((at[0], at[1]) for at in seen), radius)


def _gap(first: Patch, second: Patch) -> float:
    """The signed distance: the widest gap that two parallel lines can keep between them.

    The best lines are at right angles to an edge of either, or to a line from a corner of one to a corner of the other.
    """
    return max(
        max(low2 - high1, low1 - high2)
        for nx, ny in _normals(first, second)
        for (low1, high1), (low2, high2) in [(first.span(nx, ny), second.span(nx, ny))]
    )


def _normals(first: Patch, second: Patch) -> Iterator[Point]:
    for patch in (first, second):
        x0, y0 = patch.corners[0]
        for x, y in patch.corners[1:]:  # of a rectangle, the edges at one corner are enough; its diagonal does no harm
            if length := math.hypot(x - x0, y - y0):
                yield -(y - y0) / length, (x - x0) / length
    yield from _directions(product(first.corners, second.corners))


def _directions(pairs: Iterable[tuple[Point, Point]]) -> Iterator[Point]:
    for (x1, y1), (x2, y2) in pairs:
        length = math.hypot(x2 - x1, y2 - y1)
        yield ((x2 - x1) / length, (y2 - y1) / length) if length else (1.0, 0.0)
