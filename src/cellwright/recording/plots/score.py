"""The score over time, with what happened written at its moment."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cellwright.recording.plots.style import COLOURS, FAINT, INK, name_at_the_end
from cellwright.recording.plots.tracks import ScoreTrack, Story

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ROWS = 4  # of labels, one below another, where many things happen at once


def draw(axes: Axes, score: ScoreTrack, story: Story) -> None:
    """Draw the score as stairs.

    Args:
        axes: where; its limits along time are set.
        score: the score.
        story: for the marks and the end.
    """
    times = np.append(score.times, max(story.end, score.times[-1]))
    points = np.append(score.points, score.points[-1])
    axes.step(times, points, where="post", color=COLOURS[0], linewidth=1.6)
    axes.fill_between(times, 0.0, points, step="post", color=COLOURS[0], alpha=0.12, linewidth=0)
    top = max(float(points.max()), score.best or 0.0, 1.0)
    low = min(0.0, float(points.min()))
    axes.set_ylim(low, low + 1.12 * (top - low))
    if score.best is not None:
        axes.axhline(score.best, color=FAINT, linewidth=0.9, linestyle=(0, (4, 3)))
        named = [(f"{score.best:g} at best", score.best, INK), (f"{points[-1]:g}", float(points[-1]), COLOURS[0])]
        name_at_the_end(axes, named if points[-1] != score.best else named[:1])
    axes.locator_params(axis="y", nbins=5, integer=True)
    axes.set_title("Score")
    axes.set_ylabel("points")
    _label(axes, story)


def _label(axes: Axes, story: Story) -> None:
    """Write what happened at its moment, in rows so that nothing lies on anything."""
    width = max(story.end - story.begin, 1e-9)
    free = [story.begin - width] * _ROWS
    for mark in sorted(story.marks, key=lambda mark: mark.time):
        axes.axvline(mark.time, color=FAINT, linewidth=0.6)
        needed = 0.0095 * len(mark.label) * width
        is_late = mark.time + needed > story.end
        begin = mark.time - needed if is_late else mark.time
        row = next((row for row in range(_ROWS) if free[row] <= begin), None)
        if row is None:
            continue  # its line is there; there is no room for more words
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
