"""What came from outside and what became of it: commands over time, and states such as the competition's."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cellwright.recording.plots.style import COLOURS, FAINT, INK
from cellwright.recording.plots.tracks import Story

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST = 12
"""So many names of commands have a row; those that were used most."""

_SLICES = 400
_LIGHT = 0.35
_BLUE = (0.0, 0.447, 0.698)


def rows(story: Story) -> int:
    """How many rows the drawing has."""
    return len(story.states) + min(len(story.commands), MOST)


def draw(axes: Axes, story: Story) -> None:
    """Draw states as bars with their names, and below them commands: the darker, the more of them came."""
    ticks, row = [], 0
    for name, spans in story.states.items():
        labels = list(dict.fromkeys(span.label for span in spans))
        for span in spans:
            colour = COLOURS[labels.index(span.label) % len(COLOURS)]
            width = span.end - span.begin
            axes.barh(row, width, left=span.begin, height=0.72, color=colour, alpha=_LIGHT, linewidth=0)
            if width > 0.0095 * len(span.label) * (story.end - story.begin):
                axes.text(span.begin + width / 2, row, span.label, ha="center", va="center", fontsize=6.5, color=INK)
        ticks.append(name)
        row += 1
    most = sorted(story.commands, key=lambda track: -len(track.times))[:MOST]
    edges = np.linspace(story.begin, max(story.end, story.begin + 1e-9), _SLICES + 1)
    for track in (track for track in story.commands if any(track is each for each in most)):
        counts, _ = np.histogram(track.times, edges)
        greatest = max(int(counts.max()), 1)
        there = np.flatnonzero(counts)
        shades = [(*_BLUE, 0.25 + 0.75 * float(counts[place]) / greatest) for place in there]
        strips = [(float(edges[place]), float(edges[1] - edges[0])) for place in there]
        axes.broken_barh(strips, (row - 0.33, 0.66), facecolors=shades, linewidth=0)
        count = len(track.times)
        axes.text(1.0, row, f" {count}", transform=axes.get_yaxis_transform(), va="center", fontsize=6.8, color=FAINT)
        ticks.append(_short(track.name))
        row += 1
    axes.set_ylim(max(row, 1) - 0.5, -0.5)
    axes.set_yticks(range(len(ticks)), ticks, fontsize=7)
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.set_title("States and commands" if story.states else "Commands")


def _short(name: str) -> str:
    """A name as it stands beside the drawing: without its first part."""
    return name.strip("/").partition("/")[2] or name
