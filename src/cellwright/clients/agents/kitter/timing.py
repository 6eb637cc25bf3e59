"""How long motions take, and how fast the joints are on the way."""

from __future__ import annotations

import math
from collections.abc import Sequence

SPEEDS = (1.3, 1.6, 1.3, 2.0, 2.5, 2.5, 2.5)
"""Largest joint speeds [m/s; rad/s] on free ways."""

ACCELERATIONS = (2.5, 3.0, 2.5, 4.0, 6.0, 6.0, 8.0)
"""Largest joint accelerations [m/s^2; rad/s^2] on free ways."""


def travel_time(start: Sequence[float], goal: Sequence[float]) -> float:
    """How long [s] a cubic from rest to rest takes without exceeding speeds and accelerations."""
    ways = [abs(b - a) for a, b in zip(start, goal, strict=True)]
    by_speed = (1.5 * way / speed for way, speed in zip(ways, SPEEDS, strict=True))
    by_acceleration = (math.sqrt(6 * way / limit) for way, limit in zip(ways, ACCELERATIONS, strict=True))
    return max(0.1, *by_speed, *by_acceleration)


def eased(share: float) -> float:
    """When a share of a way is done that begins and ends gently: time as a share of the whole."""
    return 0.5 - math.sin(math.asin(1 - 2 * share) / 3)


def velocities_along(
    start: Sequence[float], points: Sequence[Sequence[float]], times: Sequence[float]
) -> list[list[float]]:
    """Velocities at points of a way: the slope between the neighbours, rest at the end.

    Args:
        start: joint positions at time 0.
        points: joint positions at the times that follow.
        times: when that is [s], rising.
    """
    places = [list(start), *map(list, points)]
    moments = [0.0, *times]
    slopes = [
        [(after - before) / (moments[index + 1] - moments[index - 1]) for before, after in zip(a, b, strict=True)]
        for index, (a, b) in enumerate(zip(places, places[2:], strict=False), start=1)
    ]
    return [*slopes, [0.0] * len(start)]
