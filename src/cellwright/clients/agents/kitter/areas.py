"""Where in the cell there is something to be seen, and what a logical camera takes in of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from cellwright.config.layout import BIN_CENTRES, BIN_WIDTH
from cellwright.util.pose import Pose, Vector3

BIN_SURFACE = 0.725
"""Height [m] of the surface that parts lie on in a bin."""

TRAY_SURFACE = 0.755
"""Height [m] of the surface of a tray's plate."""

BELT_SURFACE = 0.90691
"""Height [m] of the surface that parts ride on."""

BELT_MIDDLE, BELT_HALF_WIDTH = 1.21, 0.327
"""World x [m] of the middle of the belt, and how far it reaches to either side of it."""

NEAREST, FARTHEST = 0.2, 0.75
"""What is nearer to a logical camera, or further from it, is not in view [m]."""

HALF_WIDTH, HALF_HEIGHT = 0.613, 0.409
"""How far the view reaches to the sides, and up and down, at a distance of 1 m [m]."""

INSIDE = 0.975
"""So much of its width and height is well inside the view: noise carries nothing over the edge."""


@dataclass(frozen=True, slots=True)
class Area:
    """A box of the world, from its corner of least coordinates to that of largest [m]."""

    low: Vector3
    high: Vector3

    @classmethod
    def around(cls, points: Iterable[Vector3], margin: float = 0.0) -> Area:
        """The smallest that holds all points and a margin [m] beside them."""
        xs, ys, zs = zip(*points, strict=True)
        low = (min(xs) - margin, min(ys) - margin, min(zs) - margin)
        return cls(low, (max(xs) + margin, max(ys) + margin, max(zs) + margin))

    def meets(self, other: Area) -> bool:
        """Whether the two have a point in common."""
        return all(self.low[axis] <= other.high[axis] and other.low[axis] <= self.high[axis] for axis in range(3))


BINS = Area.around(((x, y, BIN_SURFACE) for x, y in BIN_CENTRES.values()), BIN_WIDTH / 2)
BELT = Area(
    (BELT_MIDDLE - BELT_HALF_WIDTH, -4.3, BELT_SURFACE - 0.02),
    (BELT_MIDDLE + BELT_HALF_WIDTH, 10.3, BELT_SURFACE + 0.02),
)


def view_of(world_T_camera: Pose, part_reach: float) -> Area:
    """The box around all that a logical camera can have in view, were it only an edge of a part.

    Args:
        world_T_camera: where the camera is.
        part_reach: no part reaches further [m] from its origin.
    """
    corners = [
        world_T_camera.transform((distance, distance * HALF_WIDTH * side, distance * HALF_HEIGHT * up))
        for distance in (NEAREST, FARTHEST)
        for side in (-1.0, 1.0)
        for up in (-1.0, 1.0)
    ]
    return Area.around(corners, part_reach)


def is_well_in_view(world_T_camera: Pose, point: Vector3) -> bool:
    """Whether a place of the world [m] is in the view of a logical camera, and not at its edge."""
    x, y, z = world_T_camera.inverse().transform(point)
    is_between = NEAREST < x < FARTHEST - 0.01
    return is_between and abs(y) < INSIDE * HALF_WIDTH * x and abs(z) < INSIDE * HALF_HEIGHT * x


def bin_at(x: float, y: float) -> str | None:
    """The bin that holds a place of the world; None if none does."""
    for name, (centre_x, centre_y) in BIN_CENTRES.items():
        if max(abs(x - centre_x), abs(y - centre_y)) < BIN_WIDTH / 2:
            return name
    return None
