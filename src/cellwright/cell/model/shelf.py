"""Shelf of the parts that are not in play: its size, and its slots."""

import math

from cellwright.util.pose import Pose

SHELF_SURFACE = 0.5
"""Height [m] of the shelf."""

SHELF_PITCH = 0.45
"""Distance [m] between the slots of the shelf: no part, in any orientation, reaches its neighbour."""


def shelf_slot(shelf: Pose, index: int, count: int, lower: float) -> Pose:
    """Return the shelf slot of a part; the slots form a square grid.

    Args:
        shelf: middle of the shelf, at height 0.
        index: number of the part, from 0.
        count: number of parts on the shelf.
        lower: lowest point [m] of the part below its origin, usually 0 or negative.
    """
    columns = shelf_columns(count)
    row, column = divmod(index, columns)
    shift = (columns - 1) / 2
    x, y, _ = shelf.rotate((SHELF_PITCH * (column - shift), SHELF_PITCH * (row - shift), 0.0))
    return Pose((shelf.position[0] + x, shelf.position[1] + y, SHELF_SURFACE - lower))


def shelf_columns(count: int) -> int:
    """Return the number of slots along each side of the shelf."""
    return max(1, math.ceil(math.sqrt(count)))
