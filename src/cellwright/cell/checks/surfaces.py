"""Surfaces that parts lie or ride on, as rectangles with a grid of points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cellwright.config.trial.trial import Trial
from cellwright.util.pose import Pose

SPACING = 0.05
"""Distance between the points of a grid [m]."""


@dataclass(frozen=True)
class Surface:
    """Surface for parts.

    Attributes:
        section: section of the cell that describes it: `bins`, `belts`, `carriers` or `trays`.
        name: its name there.
        middle: middle of the surface in the world; x and y are along its edges.
        size: lengths of these edges [m].
    """

    section: str
    name: str
    middle: Pose
    size: tuple[float, float]

    @property
    def key(self) -> str:
        """Dotted path to its description in a file."""
        return f"cell.{self.section}.{self.name}"

    @property
    def is_belt(self) -> bool:
        """True for a belt, whose parts ride along x."""
        return self.section == "belts"

    @cached_property
    def points(self) -> NDArray[np.float64]:
        """Points of its grid in the world [m], n along x by m along y by 3: the middles of equal fields."""
        counts = [max(1, round(length / SPACING)) for length in self.size]
        along = [length * ((np.arange(n) + 0.5) / n - 0.5) for length, n in zip(self.size, counts, strict=True)]
        x, y = np.meshgrid(*along, indexing="ij")
        return world_points(self.middle, np.stack([x, y, np.zeros_like(x)], axis=-1))


def surfaces(trial: Trial) -> tuple[Surface, ...]:
    """Return the surfaces of a trial's cell; those of AGVs at their stations.

    Example:
        >>> import cellwright
        >>> [each.name for each in surfaces(cellwright.load_trial("lesson"))][-3:]
        ['belt', 'agv1', 'agv2']
    """
    layout = trial.layout
    return (
        *(Surface("bins", each.name, each.pose @ Pose((0.0, 0.0, each.surface)), each.size) for each in layout.bins),
        *(
            Surface("belts", each.name, each.centre @ Pose((0.0, 0.0, each.size[2] / 2)), each.size[:2])
            for each in layout.belts
        ),
        *(Surface("carriers", each.name, each.tray_surface, each.plate) for each in trial.carriers),
        *(Surface("trays", each.name, each.tray_surface, each.plate) for each in layout.trays),
    )


def world_points(pose: Pose, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points in the frame of a pose as points in the world; the last axis is x, y, z [m]."""
    turn = np.array([pose.rotate(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))])
    return np.asarray(points @ turn + np.array(pose.position))
