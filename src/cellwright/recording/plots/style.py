"""Style that the charts of a recording share: colours, settings, names at curves, marks, and fewer points."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from cellwright.recording.plots.tracks import Array, Mark, Span

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#555555")
"""Colours of curves, in this order (Okabe and Ito's, without their yellow, which does not print)."""

INK, FAINT, GRID = "#222222", "#888888", "#DDDDDD"

SETTINGS: dict[Any, Any] = {
    "font.size": 8.0,
    "axes.titlesize": 9.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.5,
    "xtick.color": INK,
    "ytick.color": INK,
    "text.color": INK,
    "text.parse_math": False,  # names may contain two dollars
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "lines.linewidth": 1.1,
    "hatch.linewidth": 0.6,
    "hatch.color": "#FFFFFF",
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
}
SIZE_OF_NAMES = 7.0  # font size of names beside curves [pt]
_CURVE_SLICES = 1500  # as many as a printed page can show of a curve
_LABEL_ROWS = 4  # rows of labels, for events close in time


def name_at_the_end(axes: Axes, named: list[tuple[str, float, str]]) -> None:
    """Write names of curves at their right ends, without overlaps.

    Args:
        axes: with final limits.
        named: of each curve its name, its value at the end, and its colour.
    """
    low, high = axes.get_ylim()
    box = axes.get_window_extent()
    # The height of a line in units of the axis: points to pixels, then pixels to the share of the axis.
    min_gap = 1.35 * SIZE_OF_NAMES * axes.figure.dpi / 72.0 / max(box.height, 1.0) * (high - low)
    ordered = sorted(named, key=lambda each: each[1])
    heights = [value for _, value, _ in ordered]
    # each pushes its neighbours away until all fit
    for _ in range(200):
        worst = 0.0
        for lower in range(len(heights) - 1):
            short = min_gap - (heights[lower + 1] - heights[lower])
            if short > 1e-6 * min_gap:
                heights[lower] -= short / 2
                heights[lower + 1] += short / 2
                worst = max(worst, short)
        if worst < 1e-3 * min_gap:
            break
    for (name, _, colour), height in zip(ordered, heights, strict=True):
        axes.annotate(
            name,
            (1.0, height),
            xycoords=("axes fraction", "data"),
            xytext=(4, 0),
            textcoords="offset points",
            color=colour,
            fontsize=SIZE_OF_NAMES,
            va="center",
            annotation_clip=False,
        )


def thinned(times: Array, values: Array, slices: int = _CURVE_SLICES) -> tuple[Array, Array]:
    """Reduce the points of a curve (n,) without a visible change; a gap of nan stays one.

    A curve of at most four points a slice stays as it is.
    """
    count = len(times)
    if count <= 4 * slices:
        return times, values
    edges = np.searchsorted(times, np.linspace(times[0], times[-1], slices + 1)[1:-1])
    starts = np.unique(np.concatenate(([0], edges[edges < count])))
    is_gap = np.isnan(values)
    kept = [np.array([0, count - 1])]
    bounds = np.append(starts, count)
    # The least and the largest value of a slice draw the same column of pixels as all of its points.
    for filled, pick in ((np.inf, np.argmin), (-np.inf, np.argmax)):
        whole = np.where(is_gap, filled, values)
        chosen = [low + int(pick(whole[low:high])) for low, high in pairwise(bounds)]
        kept.append(np.array(chosen))
    gaps = np.flatnonzero(is_gap & ~np.concatenate(([False], is_gap[:-1])))  # begin of each gap
    places = np.unique(np.concatenate([*kept, gaps]))
    return times[places], values[places]


def mark_collisions(axes: Axes, collisions: Sequence[Span], label: str | None = None) -> None:
    """Shade the periods of collisions, with a cross above the begin of each: a short one is narrower than a pixel."""
    for span in collisions:
        axes.axvspan(span.begin, span.end, color=FAINT, alpha=0.25, linewidth=0)
    if collisions:
        begins = [span.begin for span in collisions]
        look: dict[str, Any] = {"marker": "x", "markersize": 4.5, "markeredgewidth": 1.2, "linestyle": ""}
        where = axes.get_xaxis_transform()
        axes.plot(begins, [0.97] * len(begins), color=INK, transform=where, clip_on=False, label=label, **look)


def label_marks(axes: Axes, marks: Sequence[Mark]) -> None:
    """Write the labels of marks at their times, in rows without overlaps; the time limits of the axes are set."""
    first, last = axes.get_xlim()
    width = last - first
    free = [first - width] * _LABEL_ROWS
    for mark in sorted(marks, key=lambda mark: mark.time):
        needed = 0.0095 * len(mark.label) * width
        is_late = mark.time + needed > last
        begin = mark.time - needed if is_late else mark.time
        row = next((row for row in range(_LABEL_ROWS) if free[row] <= begin), None)
        if row is None:
            # it is drawn without its label: no row has room
            continue
        free[row] = begin + needed + 0.01 * width
        axes.annotate(
            mark.label,
            (mark.time, 0.80 - 0.15 * row),
            xycoords=("data", "axes fraction"),
            xytext=(-3 if is_late else 3, 0),
            textcoords="offset points",
            ha="right" if is_late else "left",
            va="center",
            fontsize=6.8,
            color=INK,
            bbox={"boxstyle": "square,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.8},
        )


def finish_rows(axes: Axes, rows: int, title: str) -> None:
    """Set up an axis of rows, the first at the top."""
    axes.set_ylim(max(rows, 1) - 0.5, -0.5)
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.set_title(title)
