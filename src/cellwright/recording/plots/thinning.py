"""Long curves as ones that look the same: of each slice of time its least and its greatest value."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from cellwright.recording.plots.tracks import Array

SLICES = 1500
"""Of a curve: as many as a printed page can show."""


def thinned(times: Array, values: Array, slices: int = SLICES) -> tuple[Array, Array]:
    """Fewer points of a curve, which is drawn the same.

    Args:
        times: (n,) ascending.
        values: (n,); nan is a gap, and stays one.
        slices: how many; a curve with fewer than four points for each stays as it is.

    Returns:
        Times and values, the first and the last point among them.
    """
    count = len(times)
    if count <= 4 * slices:
        return times, values
    edges = np.searchsorted(times, np.linspace(times[0], times[-1], slices + 1)[1:-1])
    starts = np.unique(np.concatenate(([0], edges[edges < count])))
    is_gap = np.isnan(values)
    kept = [np.array([0, count - 1])]
    bounds = np.append(starts, count)
    for filled, pick in ((np.inf, np.argmin), (-np.inf, np.argmax)):
        whole = np.where(is_gap, filled, values)
        chosen = [low + int(pick(whole[low:high])) for low, high in pairwise(bounds)]
        kept.append(np.array(chosen))
    gaps = np.flatnonzero(is_gap & ~np.concatenate(([False], is_gap[:-1])))  # where each of them begins
    places = np.unique(np.concatenate([*kept, gaps]))
    return times[places], values[places]
