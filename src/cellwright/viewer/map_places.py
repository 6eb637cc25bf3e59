"""Places on a map of a cell: outlines from above, and where names cover least. x points up, y to the left [m]."""

import math
from collections.abc import Iterable, Sequence

from cellwright.util.pose import Pose

Point = tuple[float, float]
Span = tuple[Point, Point]
"""Lower and upper corner of a rectangle along the axes."""


def corners_of(middle: Pose, size: Sequence[float]) -> list[Point]:
    """Return the corners of a rectangle about a pose, around its edge."""
    a, b = size[0] / 2, size[1] / 2
    return [middle.transform((x, y, 0.0))[:2] for x, y in ((a, b), (-a, b), (-a, -b), (a, -b))]


def span(points: Iterable[Point]) -> Span:
    """Return the rectangle along the axes around points."""
    x, y = zip(*points, strict=True)
    return (min(x), min(y)), (max(x), max(y))


def shared_area(one: Span, other: Span) -> float:
    """Return the area that two rectangles share [m^2]."""
    lengths = (min(one[1][axis], other[1][axis]) - max(one[0][axis], other[0][axis]) for axis in (0, 1))
    return math.prod(max(0.0, length) for length in lengths)


def edges(points: Iterable[Point], *, upper_first: bool = True) -> list[tuple[Point, Point]]:
    """Return places for a name inside, and then outside, the upper and the lower edge of what is around points.

    Each is a point, and the direction in which the name is from it.
    """
    (low, left), (high, right) = span(points)
    found = [(high, -1), (low, 1)][:: 1 if upper_first else -1]
    return [((x, (left + right) / 2), (sign * inwards, 0)) for sign in (1, -1) for x, inwards in found]
