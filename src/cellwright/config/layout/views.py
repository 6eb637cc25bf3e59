"""Views of a cell: those of its layout, and computed ones for all that has none."""

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache

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
_ARM = Pose((0.0, 0.0, 0.55)), (0.9, 1.4, 1.1)
_RAIL = Pose((0.0, 0.0, -0.1)), (0.4, 2 * RAIL_LIMIT + 0.4, 0.3)
"""Boxes around the arm at its start, and around its rail, in the frame of the rail: middle, and edge lengths [m]."""
_FLOOR = ((-1.0, -1.0, 0.0), (1.0, 1.0, 1.0))
"""Opposite corners of the space that is looked at where a cell has nothing [m]."""
_PIECES = 40
"""Number of pieces that a belt is cut into, to find those near the other things."""


@lru_cache(maxsize=8)
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
    computed = _Computed(layout.moved(layout.frame.inverse()))
    bins = [BINS] if layout.bins else []
    names = (OVERVIEW, *bins, *(each.name for each in layout.stations), *(each.name for each in layout.belts))
    found = {name: own.get(name) or computed.view(name).moved(layout.frame) for name in names}
    return tuple({**found, **own}.values())


class _Computed:
    """Views of a layout whose frame is the world's."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._bins = [point for each in layout.bins for point in _over(each.pose, each.size, each.surface)]
        self._trays = {each.name: [*_over(each.tray_surface, each.plate, each.surface)] for each in layout.stations}
        rails = [end for arm in layout.arms for end in arm.mount.ends]
        robots = [corner for each in layout.robots for corner in each.corners]
        self._around = [*self._bins, *(point for points in self._trays.values() for point in points), *rails, *robots]

    def view(self, name: str) -> View:
        """Return the view of all, of the bins, or of a tray or a belt."""
        if name == OVERVIEW:
            belts = (point for belt in self._layout.belts for point in _near(belt, self._around))
            return _look(name, [*self._around, *belts] or list(_FLOOR), -148, 25, 46)
        if name == BINS:
            return self._clearest(name, self._bins, (180, 0, 90, -90), 45, 50)
        if name in self._trays:
            return self._clearest(name, self._trays[name], (-150, 150, -30, 30), 33, 37)
        belt = next(each for each in self._layout.belts if each.name == name)
        along = math.degrees(math.atan2(belt.direction[1], belt.direction[0]))
        return _look(name, _near(belt, self._around), along - 13, 23, 52)

    def _clearest(self, name: str, points: list[Vector3], turns: tuple[float, ...], tilt: float, angle: float) -> View:
        """Return the view from the direction in which the fewest points are hidden; the first of several."""
        boxes = [(middle.inverse(), size) for middle, size in _obstacles(self._layout)]
        found = [_look(name, points, turn, tilt, angle) for turn in turns]
        return min(found, key=lambda view: sum(_is_hidden(point, view.position, boxes) for point in points))


def _obstacles(layout: Layout) -> Iterator[tuple[Pose, Vector3]]:
    """Yield the boxes that may stand before what a view shows: middle and edge lengths."""
    for each in layout.structure:
        for block in (*each.boxes, *each.drawn):
            yield each.pose @ block.middle, block.size
    for arm in layout.arms:
        yield from ((arm.pose @ middle, size) for middle, size in (_ARM, _RAIL) if arm.is_original or size is _ARM[1])


def _is_hidden(point: Vector3, eye: Vector3, boxes: list[tuple[Pose, Vector3]]) -> bool:
    """Return whether the line of sight to a point goes through a box, given by box_T_world and its edge lengths."""
    for inverse, size in boxes:
        begin, end = inverse.transform(eye), inverse.transform(point)
        first, last = 0.0, 1.0
        # the shares of the line that lie between the box's faces, axis by axis
        for start, stop, edge in zip(begin, end, size, strict=True):
            if abs(stop - start) < 1e-12:
                if abs(start) > edge / 2:
                    last = -1.0
                continue
            enter, leave = sorted(((side * edge / 2 - start) / (stop - start)) for side in (-1, 1))
            first, last = max(first, enter), min(last, leave)
        if first <= last:
            return True
    return False


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
    if not around:
        return [point for row in rows for point in row]
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
        turn: direction from the points to the camera, about the vertical [degrees].
        tilt: its angle above the horizontal [degrees].
        angle: vertical opening angle [degrees].
    """
    turn, tilt, angle = map(math.radians, (turn, tilt, angle))
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
