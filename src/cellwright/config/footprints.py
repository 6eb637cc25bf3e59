"""Footprints of parts: the floor that a part covers, and the gaps between two parts.

Figures: the meshes of the 2017 competition.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from types import MappingProxyType
from typing import TypeAlias

from cellwright.util.pose import Pose

Piece: TypeAlias = tuple[float, float, float, float, float]
"""Piece of a part's footprint: centre x, y, half edges a, b and radius r [m].

All points within r of a rectangle with its edges along the part's axes; a disc has no edges, a box no radius.
"""

PART_FOOTPRINTS: Mapping[str, tuple[Piece, ...]] = MappingProxyType(
    {
        "part1": ((0.0, 0.0, 0.1504, 0.0512, 0.0),),
        "part2": ((0.0, 0.0, 0.03, 0.0075, 0.0),),
        "part3": ((0.03, 0.03, 0.0679, 0.0728, 0.0),),
        "part4": ((0.0, 0.0, 0.045, 0.03, 0.0),),
        "disk_part": ((0.0, 0.0, 0.0, 0.0, 0.0627),),
        "gasket_part": ((0.0, 0.0, 0.094, 0.043, 0.0),),
        "gear_part": ((0.0, 0.0, 0.0, 0.0, 0.0392),),
        "piston_rod_part": ((0.0, 0.0, 0.0295, 0.026, 0.0), (0.0, 0.08, 0.0155, 0.055, 0.0)),
        "pulley_part": ((0.0, 0.0, 0.0, 0.0, 0.1125),),
    }
)
"""Footprint of each part type on the plane it lies on, in the part's frame, upright."""

PART_RADII: Mapping[str, float] = MappingProxyType(
    {
        "part1": 0.16,
        "part2": 0.033,
        "part3": 0.144,
        "part4": 0.055,
        "disk_part": 0.093,
        "gasket_part": 0.107,
        "gear_part": 0.058,
        "piston_rod_part": 0.139,
        "pulley_part": 0.175,
    }
)
"""Maximum distance [m] of each part type's surface from its origin, rounded up to the mm."""

PART_TYPES = frozenset(PART_RADII)
"""Part types that have a model."""

Point: TypeAlias = tuple[float, float]

UNKNOWN_RADIUS = 0.1
"""Radius [m] of the disc that represents a part of which only the place is known."""

_FLAT = 0.999
"""Vertical component of a part's z axis from which it counts as lying flat, either way up: 2.6 degrees."""


@dataclass(frozen=True, slots=True)
class Patch:
    """Convex piece of a footprint in the world: all points within `radius` [m] of the hull of `corners` [m]."""

    corners: tuple[Point, ...]
    radius: float

    def span(self, nx: float, ny: float) -> tuple[float, float]:
        """Return its minimum and maximum along a unit vector [m]."""
        along = [x * nx + y * ny for x, y in self.corners]
        return min(along) - self.radius, max(along) + self.radius


@dataclass(frozen=True, slots=True)
class Footprint:
    """Footprint of a part, made of convex patches; all of it is within `radius` [m] of `centre` [m]."""

    centre: Point
    radius: float
    patches: tuple[Patch, ...]

    def gap(self, other: Footprint, cutoff: float) -> float:
        """Return the distance to another footprint [m], negative if they overlap.

        If it is above `cutoff`, the result may be any number above `cutoff`.
        """
        far = math.dist(self.centre, other.centre) - self.radius - other.radius
        if far > cutoff:
            return far
        return min(_gap(a, b) for a, b in product(self.patches, other.patches))

    def margin(self, area: Pose, size: tuple[float, float]) -> float:
        """Return the clearance [m] to the edges of a rectangle; negative outside.

        Args:
            area: its middle; its edges are along x and y.
            size: lengths of these edges [m].
        """
        margins = []
        for axis, length in zip(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), size, strict=True):
            nx, ny, _ = area.rotate(axis)
            middle = nx * area.position[0] + ny * area.position[1]
            spans = [patch.span(nx, ny) for patch in self.patches]
            margins.append(length / 2 - max(max(middle - lower, upper - middle) for lower, upper in spans))
        return min(margins)


def footprint(part_type: str, world_T_part: Pose) -> Footprint:
    """Return the footprint of a part at its pose.

    A part that lies flat, either way up, covers its shapes. A tilted one may cover all within its radius, and one of an
    unknown type all within `UNKNOWN_RADIUS`.

    Example:
        >>> first, second = (footprint("gear_part", Pose((x, 0.0, 0.7))) for x in (0.0, 0.1))
        >>> round(first.gap(second, cutoff=1.0), 4)
        0.0216
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
    """Return the signed distance: the widest gap between two parallel lines that separate the patches.

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
        # the edges at one corner of a rectangle suffice; its diagonal does no harm
        for x, y in patch.corners[1:]:
            if length := math.hypot(x - x0, y - y0):
                yield -(y - y0) / length, (x - x0) / length
    for (x1, y1), (x2, y2) in product(first.corners, second.corners):
        length = math.hypot(x2 - x1, y2 - y1)
        yield ((x2 - x1) / length, (y2 - y1) / length) if length else (1.0, 0.0)
