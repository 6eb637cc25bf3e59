"""Surfaces that are in a cell, and the points on them that checks look at."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from cellwright.config.layout.surfaces import Surface, surfaces
from cellwright.config.trial.trial import Trial
from cellwright.util.pose import Pose

SPACING = 0.05
"""Distance between the points of a grid [m]."""


def surfaces_in(trial: Trial) -> tuple[Surface, ...]:
    """Return the surfaces of a trial's cell, without those of AGVs that it leaves out."""
    return tuple(each for each in surfaces(trial.layout) if trial.carriers or each.section != "carriers")


@lru_cache(maxsize=64)
def points_on(surface: Surface) -> NDArray[np.float64]:
    """Return points in a grid on a surface, in the world [m].

    They are n along its x by m along its y by 3: the middles of equal fields.
    """
    counts = [max(1, round(length / SPACING)) for length in surface.size]
    along = [length * ((np.arange(n) + 0.5) / n - 0.5) for length, n in zip(surface.size, counts, strict=True)]
    x, y = np.meshgrid(*along, indexing="ij")
    return world_points(surface.middle, np.stack([x, y, np.zeros_like(x)], axis=-1))


def world_points(pose: Pose, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points in the frame of a pose as points in the world; the last axis is x, y, z [m]."""
    turn = np.array([pose.rotate(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))])
    return np.asarray(points @ turn + np.array(pose.position))
