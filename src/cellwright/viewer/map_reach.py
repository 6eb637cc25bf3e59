"""Fields of a map of a cell by what arms reach, tool down."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cellwright.cell.checks.clearance import PlaceReach, State
from cellwright.cell.checks.reach import in_reach, reaches
from cellwright.cell.checks.surfaces import points_on, surfaces_in
from cellwright.config.layout.surfaces import Surface
from cellwright.config.trial.trial import Trial
from cellwright.util.pose import Pose


@dataclass(frozen=True, slots=True)
class Mark:
    """Mark of the points in a state: its colour, its opacity in 0..1, and its meaning."""

    state: State
    colour: str
    opacity: float
    meaning: str


OUT_OF_REACH = Mark(State.OUT, "#c0392b", 0.3, "out of reach, tool down")
"""The only mark on a map of the cell."""

MARKS = (
    Mark(State.CLEAR, "#2f9e5b", 0.65, "in reach and clear"),
    Mark(State.BLOCKED, "#e9a100", 0.75, "arm touches something"),
    Mark(State.OUT, "#c0392b", 0.6, "out of reach, tool down"),
)
"""Marks on a map of the reach."""


def fields(trial: Trial, places: Sequence[PlaceReach]) -> Iterator[tuple[Mark, Pose, tuple[float, float]]]:
    """Yield rectangles with one mark, each with its middle in the world and its size [m].

    At each point the arm counts that can do most there. Without places none are marked if an arm is not quick to solve.
    """
    arms = () if places else reaches(trial)
    is_known = bool(trial.arms) and all(arm.is_quick for arm in arms)
    for surface in surfaces_in(trial) if is_known else ():
        known = [each.states for each in places if each.surface == surface]
        states = np.max(known, axis=0) if known else np.where(in_reach(surface, arms), State.CLEAR, State.OUT)
        for mark in MARKS if places else (OUT_OF_REACH,):
            for middle, size in _strips(surface, states == mark.state):
                yield mark, middle, size


def _strips(surface: Surface, mask: NDArray[np.bool_]) -> Iterator[tuple[Pose, tuple[float, float]]]:
    """Yield strips along y, so that the picture has few shapes."""
    rows, columns = mask.shape
    points, size = points_on(surface), (surface.size[0] / rows, surface.size[1] / columns)
    for row in range(rows):
        for begin, end in _runs(mask[row]):
            x, y, _ = ((points[row, begin] + points[row, end - 1]) / 2).tolist()
            yield Pose((x, y, 0.0), surface.middle.quaternion), (size[0], size[1] * (end - begin))


def _runs(mask: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Yield the stretches of a mask that are true, each as its begin and the index behind its end."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    yield from zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
