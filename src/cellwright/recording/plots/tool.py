"""Where a tool went: its path from above, and its height over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from cellwright.recording.plots.style import COLOURS, FAINT, INK
from cellwright.recording.plots.thinning import thinned
from cellwright.recording.plots.tracks import Array, Span, ToolTrack

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LOADED, _ON = "#D55E00", "#0072B2"
_LEGEND = 60  # characters that a legend beside the title has room for
_POINTS = 20_000  # of a path from above, which cannot be thinned by time


def draw_from_above(axes: Axes, tools: Sequence[ToolTrack]) -> None:
    """Draw paths from above: x to the right and y up, or y to the left and x up where that lies better on the page."""
    extent = np.ptp(np.concatenate([tool.positions[:, :2] for tool in tools]), axis=0)
    across, up = (1, 0) if extent[1] > extent[0] else (0, 1)
    for tool, colour in zip(tools, COLOURS, strict=False):
        step = max(1, len(tool.times) // _POINTS)
        times, at = tool.times[::step], tool.positions[::step]
        has_cup = bool(tool.on or tool.attached)
        colour, label = (FAINT, None) if has_cup else (colour, tool.name)
        axes.plot(at[:, across], at[:, up], color=colour, linewidth=0.8, label=label)
        carried = _inside(times, tool.attached)
        if carried.any():
            there = np.where(carried[:, np.newaxis], at, np.nan)
            axes.plot(there[:, across], there[:, up], color=_LOADED, linewidth=1.6, label="carries a part")
        for span in tool.attached:
            _dot(axes, tool, span.begin, (across, up), "^", "picked up")
            if span.end < tool.times[-1]:
                _dot(axes, tool, span.end, (across, up), "v", "let go")
    axes.set_title("Tool from above" if len(tools) == 1 else "Tools from above")
    axes.set_xlabel(f"{'xy'[across]} [m] in {tools[0].frame}")
    axes.set_ylabel(f"{'xy'[up]} [m]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.06)
    if across:
        axes.invert_xaxis()  # y to the left of x, as seen from above
    _legend(axes)


def draw_height(axes: Axes, tools: Sequence[ToolTrack]) -> None:
    """Draw heights over time, and below when a cup sucks and holds."""
    for tool, colour in zip(tools, COLOURS, strict=False):
        has_cup = bool(tool.on or tool.attached)
        times, height = thinned(tool.times, tool.positions[:, 2])
        axes.plot(times, height, color=INK if has_cup else colour, label=None if has_cup else tool.name)
        for spans, strip, label in ((tool.on, _ON, "suction on"), (tool.attached, _LOADED, "carries a part")):
            place = 0.0 if strip == _ON else 0.035
            for number, span in enumerate(spans):
                axes.axvspan(
                    span.begin,
                    span.end,
                    place,
                    place + 0.03,
                    color=strip,
                    linewidth=0,
                    label=label if number == 0 else None,
                )
    axes.margins(y=0.12)
    axes.set_title(f"{'Tool height' if len(tools) == 1 else 'Heights of the tools'}")
    axes.set_ylabel("z [m]")
    _legend(axes)


def _legend(axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    if once:
        is_wide = sum(map(len, once)) > _LEGEND
        axes.legend(
            once.values(),
            once.keys(),
            loc="upper left" if is_wide else "lower right",  # of the legend, which stands beside or above the drawing
            bbox_to_anchor=(1.01, 1.0) if is_wide else (1.0, 1.0),
            ncols=1 if is_wide else 4,
            borderpad=0,
            handlelength=1.4,
        )


def _inside(times: Array, spans: Sequence[Span]) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    found = np.zeros(len(times), bool)
    for span in spans:
        found |= (times >= span.begin) & (times <= span.end)
    return found


def _dot(axes: Axes, tool: ToolTrack, time: float, along: tuple[int, int], marker: str, label: str) -> None:
    x, y = (float(np.interp(time, tool.times, tool.positions[:, axis])) for axis in along)
    look: dict[str, Any] = {"markersize": 5.5, "markeredgewidth": 0.6, "markeredgecolor": "white", "linestyle": ""}
    axes.plot([x], [y], marker=marker, color=_LOADED if marker == "^" else INK, label=label, zorder=3, **look)
