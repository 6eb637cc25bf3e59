"""Views of a cell: those of its layout, and computed ones for all that has none."""

import math
from collections.abc import Iterator, Sequence

from cellwright.config.arm import RAIL_LIMIT
from cellwright.config.layout.layout import Belt, Layout
from cellwright.config.layout.surroundings import View
from cellwright.util.pose import Pose, Vector3

OVERVIEW, BINS = "overview", "bins"
_ASPECT = 16 / 9
"""Width of the picture over its height."""
_FILLED = 0.92
"""Share of the picture's width and height that may be filled."""
_NEAREST = 1.0
"""Least distance [m] of a camera from what it shows: nearer, the smallest tray would fill the picture."""
_PARTS = 0.15
"""Height [m] over a surface up to which parts on it are in the picture."""
_BESIDE = 1.5
"""Length of a belt [m] that is in the picture beyond the other things of the cell."""
_PIECES = 40
"""Number of pieces that a belt is cut into, to find those near the other things."""


def views(layout: Layout) -> tuple[View, ...]:
    """Return the views of a layout, `overview` first.

    There is one for each belt, AGV and tray, by its name, and `bins` if there are bins. The layout's own views of these
    names have precedence; its other views come last.

    Example:
        >>> from cellwright.config.layout.gear2017 import gear2017
        >>> [view.name for view in views(gear2017())]
        ['overview', 'bins', 'agv1', 'agv2', 'belt']
    """
    own = {view.name: view for view in layout.views}
    # directions and distances are along the axes of the layout: a cell that is turned has the same views
    computed = {view.name: view.moved(layout.frame) for view in _computed(layout.moved(layout.frame.inverse()))}
    return tuple({**computed, **own}.values())


def _computed(layout: Layout) -> Iterator[View]:
    bins = [point for each in layout.bins for point in _over(each.pose, each.size, each.surface)]
    trays = {each.name: [*_over(each.tray_surface, each.plate, each.surface)] for each in layout.stations}
    rail = [layout.rail.transform((0.0, y, 0.0)) for y in (-RAIL_LIMIT, RAIL_LIMIT)]
    around = [*bins, *(point for points in trays.values() for point in points), *rail]
    belts = {belt.name: _near(belt, around) for belt in layout.belts}
    everything = [*around, *(point for points in belts.values() for point in points)]
    yield _look(OVERVIEW, everything, math.radians(-148), math.radians(25), math.radians(46))
    if bins:
        yield _look(BINS, bins, math.pi, math.radians(45), math.radians(50))
    for name, points in trays.items():
        yield _look(name, points, math.radians(-150), math.radians(33), math.radians(37))
    for belt in layout.belts:
        x, y, _ = belt.direction
        yield _look(
            belt.name, belts[belt.name], math.atan2(y, x) - math.radians(13), math.radians(23), math.radians(52)
        )


def _over(middle: Pose, size: tuple[float, float], surface: float) -> Iterator[Vector3]:
    """Yield the corners of the space for parts over a surface, whose height is in the world."""
    for x in (-size[0] / 2, size[0] / 2):
        for y in (-size[1] / 2, size[1] / 2):
            at = middle.transform((x, y, 0.0))
            yield at[0], at[1], surface
            yield at[0], at[1], surface + _PARTS


def _near(belt: Belt, around: Sequence[Vector3]) -> list[Vector3]:
    """Return points on the edges of a belt that are near the other things of a cell; of all of it if none is."""
    length, width, _ = belt.size
    rows = [
        [belt.centre.transform((length * (k / _PIECES - 0.5), y, belt.size[2] / 2)) for y in (-width / 2, width / 2)]
        for k in range(_PIECES + 1)
    ]
    low, high = ([choose(point[k] for point in around) for k in range(2)] for choose in (min, max))

    def is_near(point: Vector3) -> bool:
        return all(low[k] - _BESIDE <= point[k] <= high[k] + _BESIDE for k in range(2))

    near = [point for row in rows if any(map(is_near, row)) for point in row]
    return near or [point for row in rows for point in row]


def _look(name: str, points: list[Vector3], turn: float, tilt: float, angle: float) -> View:
    """Return a view of points from a direction: so far away that all of them are in the picture.

    Args:
        name: name of the view.
        points: the points.
        turn: direction from the points to the camera, about the vertical.
        tilt: its angle above the horizontal.
        angle: vertical opening angle.
    """
    low, high = ([choose(point[k] for point in points) for k in range(3)] for choose in (min, max))
    x, y, z = ((low[k] + high[k]) / 2 for k in range(3))
    back = (math.cos(tilt) * math.cos(turn), math.cos(tilt) * math.sin(turn), math.sin(tilt))
    up = (-math.sin(tilt) * math.cos(turn), -math.sin(tilt) * math.sin(turn), math.cos(tilt))
    right = (-math.sin(turn), math.cos(turn), 0.0)
    slope = math.tan(angle / 2) * _FILLED
    distance = _NEAREST
    for point in points:
        offset = (point[0] - x, point[1] - y, point[2] - z)
        # the camera must be this far from the plane of the point, for its height and its width in the picture
        need = max(abs(_dot(offset, up)) / slope, abs(_dot(offset, right)) / (slope * _ASPECT))
        distance = max(distance, _dot(offset, back) + need)
    eye = (x + distance * back[0], y + distance * back[1], z + distance * back[2])
    return View(name, eye, (x, y, z), angle)


def _dot(a: Vector3, b: Vector3) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
