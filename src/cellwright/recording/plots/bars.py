"""Charts with a row of bars each: parts on the trays, states, and commands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cellwright.recording.plots.style import COLOURS, FAINT, INK, finish_rows
from cellwright.recording.plots.tracks import PlotData, TrackedTrayPart

if TYPE_CHECKING:
    from matplotlib.axes import Axes

VERDICTS = {
    "": ("#9AA5AE", ""),
    "right": ("#009E73", ""),
    "faulty": ("#D55E00", "////"),
    "not ordered": ("#E69F00", "...."),
}
"""Colour and hatching of a part on a tray, by its verdict; the hatching distinguishes them in grey."""
MAX_COMMANDS = 12
"""Maximum number of rows of commands; the most frequent ones are drawn."""
MAX_PARTS = 40
"""Maximum number of bars of each tray; the first ones are drawn."""
_SLICES = 400
_LIGHT = 0.35
_BLUE = (0.0, 0.447, 0.698)


def command_rows(data: PlotData) -> int:
    """Return the number of rows of the drawing."""
    return len(data.states) + min(len(data.commands), MAX_COMMANDS)


def draw_commands(axes: Axes, data: PlotData) -> None:
    """Draw states as bars with their names, and below them commands: the more came, the darker."""
    ticks, row = [], 0
    for name, spans in data.states.items():
        labels = list(dict.fromkeys(span.label for span in spans))
        for span in spans:
            colour = COLOURS[labels.index(span.label) % len(COLOURS)]
            width = span.end - span.begin
            axes.barh(row, width, left=span.begin, height=0.72, color=colour, alpha=_LIGHT, linewidth=0)
            if width > 0.0095 * len(span.label) * (data.end - data.begin):
                axes.text(span.begin + width / 2, row, span.label, ha="center", va="center", fontsize=6.5, color=INK)
        ticks.append(name)
        row += 1
    frequent = sorted(data.commands, key=lambda track: -len(track.times))[:MAX_COMMANDS]
    edges = np.linspace(data.begin, max(data.end, data.begin + 1e-9), _SLICES + 1)
    for track in (track for track in data.commands if any(track is each for each in frequent)):
        counts, _ = np.histogram(track.times, edges)
        maximum = max(int(counts.max()), 1)
        there = np.flatnonzero(counts)
        shades = [(*_BLUE, 0.25 + 0.75 * float(counts[place]) / maximum) for place in there]
        strips = [(float(edges[place]), float(edges[1] - edges[0])) for place in there]
        axes.broken_barh(strips, (row - 0.33, 0.66), facecolors=shades, linewidth=0)
        count = len(track.times)
        axes.text(1.0, row, f" {count}", transform=axes.get_yaxis_transform(), va="center", fontsize=6.8, color=FAINT)
        ticks.append(track.name.strip("/").partition("/")[2] or track.name)  # without its first part
        row += 1
    axes.set_yticks(range(len(ticks)), ticks, fontsize=7)
    finish_rows(axes, row, "States and commands" if data.states else "Commands")


def tray_rows(data: PlotData) -> int:
    """Return the number of rows of the drawing: one for each part, and at least one for each tray."""
    counts = [sum(part.tray == tray for part in data.tray_parts) for tray in data.trays]
    return sum(min(max(count, 1), MAX_PARTS) for count in counts)


def draw_trays(axes: Axes, data: PlotData) -> None:
    """Draw the trays one below another, the first at the top."""
    row, ticks = 0, []
    for tray in data.trays:
        parts = sorted((part for part in data.tray_parts if part.tray == tray), key=lambda part: part.begin)
        first = row
        for part in parts[:MAX_PARTS]:
            colour, hatch = VERDICTS.get(part.verdict, VERDICTS[""])
            length = part.end - part.begin
            axes.barh(row, length, left=part.begin, height=0.78, color=colour, hatch=hatch, edgecolor="white")
            _name_part(axes, row, part, colour, data)
            row += 1
        row += not parts
        words = tray if len(parts) <= MAX_PARTS else f"{tray}: the first {MAX_PARTS} of {len(parts)}"
        ticks.append(((first + row - 1) / 2, words))
        for mark in data.marks:
            if mark.tray == tray:
                axes.plot([mark.time] * 2, [first - 0.5, row - 0.5], color=INK, linewidth=1.2)
        axes.axhline(row - 0.5, color=FAINT, linewidth=0.6)
    axes.set_yticks([place for place, _ in ticks], [words for _, words in ticks])
    finish_rows(axes, row, "On the trays")
    verdicts = {part.verdict for part in data.tray_parts}
    handles: list[Any] = [
        axes.barh(-9, 0, color=colour, hatch=hatch, edgecolor="white", label=verdict or "not judged")
        for verdict, (colour, hatch) in VERDICTS.items()
        if verdict in verdicts
    ]
    if any(mark.tray for mark in data.marks):
        handles += axes.plot([], [], color=INK, linewidth=1.2, label="kit judged")
    if handles:
        corner = (1.0, 1.0)
        axes.legend(handles=handles, loc="lower right", bbox_to_anchor=corner, ncols=5, borderpad=0, handlelength=1.4)


def _name_part(axes: Axes, row: int, part: TrackedTrayPart, behind: str, data: PlotData) -> None:
    """Write a part's name into its bar if it fits, else beside it."""
    from matplotlib.patheffects import withStroke

    width = max(data.end - data.begin, 1e-9)
    needed, space = 0.0105 * len(part.name) * width, 0.005 * width  # for this font size and page width
    if part.end - part.begin >= needed:
        text = axes.text(part.begin + space, row, part.name, va="center", fontsize=6.5, color="white")
        text.set_path_effects([withStroke(linewidth=2.0, foreground=behind)])  # the bar may be hatched
    elif part.begin - data.begin >= needed:
        axes.text(part.begin - space, row, part.name, ha="right", va="center", fontsize=6.5)
    else:
        axes.text(part.end + space, row, part.name, va="center", fontsize=6.5)
