"""Reach of the arm over the surfaces of a cell, with its tool pointing down.

The axis of wrist 3 is vertical then, so a yaw of the tool changes nothing, and a turn of the pan axis as little.
Whether a point can be reached depends on its height and its horizontal distance from the pan axis alone. So one scan of
distances a height is enough for a whole surface, however many points it has.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from cellwright.cell.checks.surfaces import points_on, world_points
from cellwright.config.arm import RAIL_LIMIT
from cellwright.config.layout.layout import Layout
from cellwright.config.layout.surfaces import Surface
from cellwright.motion.kinematics import BASE_X, arm_frame, inverse, tool_down
from cellwright.util.errors import UnreachableError

CLEARANCE = 0.02
"""Height of the tool over a surface [m]."""

_STEP, _FARTHEST = 0.02, 1.6
"""Step and end of the scan of distances from the pan axis [m]."""
_EXACT = 1e-4
"""Width [m] to which the ends of reach are found."""
_DIGITS = 3
"""Digits of the heights [m] for which the scan is done once."""


def in_reach(surface: Surface, layout: Layout) -> NDArray[np.bool_]:
    """Return the mask of a surface's points that the tool of some arm can reach, from some place of its rail."""
    reached: NDArray[np.bool_] = np.zeros(points_on(surface).shape[:2], dtype=np.bool_)
    for arm in layout.arms:
        # the kinematics are those of 2017's rail, so the cell is seen from there
        reached |= _reached(world_points(arm_frame(arm.pose).inverse(), points_on(surface)))
    return reached


def _reached(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    reached: NDArray[np.bool_] = np.zeros(points.shape[:2], dtype=np.bool_)
    aside = np.abs(points[..., 0] - BASE_X)
    # how far along the rail the pan axis can be from the point, at least and at most
    nearest = np.maximum(np.abs(points[..., 1]) - RAIL_LIMIT, 0.0)
    farthest = np.abs(points[..., 1]) + RAIL_LIMIT
    for inner, outer in _rings(round(float(points[0, 0, 2]) + CLEARANCE, _DIGITS)):
        low = np.sqrt(np.maximum(inner**2 - aside**2, 0.0))
        high = np.sqrt(np.maximum(outer**2 - aside**2, 0.0))
        reached = np.asarray(reached | (aside <= outer) & (low <= farthest) & (high >= nearest))
    return reached


def share_out_of_reach(surface: Surface, layout: Layout) -> float:
    """Return the share of a surface that the tool cannot reach; of a belt, that of its width.

    Parts ride along a belt, so a strip of its width counts as reached if the tool reaches it anywhere.
    """
    reached = in_reach(surface, layout)
    if surface.is_belt:
        reached = np.asarray(reached.any(axis=0))
    return 1.0 - float(np.mean(reached))


@cache
def _rings(height: float) -> tuple[tuple[float, float], ...]:
    """Return the intervals of distances from the pan axis that the tool reaches at a height [m] of 2017's cell."""
    found: list[tuple[float, float]] = []
    before, begin = False, 0.0
    for distance in (step * _STEP for step in range(round(_FARTHEST / _STEP))):
        now = _reaches(distance, height)
        if now != before:
            edge = _edge(distance - _STEP, distance, height) if distance else 0.0
            if now:
                begin = edge
            else:
                found.append((begin, edge))
        before = now
    return tuple(found)


def _edge(low: float, high: float, height: float) -> float:
    """Return the distance [m] between two at which reach begins or ends, by bisection."""
    wanted = _reaches(low, height)
    while high - low > _EXACT:
        middle = (low + high) / 2
        low, high = (middle, high) if _reaches(middle, height) == wanted else (low, middle)
    return low if wanted else high


def _reaches(distance: float, height: float) -> bool:
    try:
        inverse(tool_down(BASE_X + distance, 0.0, height), 0.0)
    except UnreachableError:
        return False
    return True
