"""Charts with curves: joints, score, and a tool's path from above and height."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np

from cellwright.recording.plots.style import COLOURS, FAINT, INK, label_marks, mark_collisions, name_at_the_end, thinned
from cellwright.recording.plots.tracks import (
    Array,
    CollisionSpan,
    JointTrack,
    Mark,
    PlotData,
    ScoreTrack,
    Span,
    ToolTrack,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MAX_JOINTS = len(COLOURS)
"""Maximum number of curves that a reader can distinguish; of more joints, those that move most are drawn."""
STILL = 1e-3
"""Range of motion [rad; m] below which a joint stands still."""
_UNITS = {"rad": "position [rad]", "m": "position [m]"}
_LOADED, _SUCTION_ON = "#D55E00", "#0072B2"
_LEGEND = 60  # maximum characters of a legend beside the title
_POINTS = 20_000  # maximum points of a path from above, which cannot be thinned by time


def draw_joints(axes: Axes, group: str, tracks: Sequence[JointTrack], collisions: Sequence[Span] = ()) -> None:
    """Draw joints of one group and one unit, and the collisions; the time limits of the axes are set."""
    drawn = joints_to_draw(tracks)
    for track, colour in zip(drawn, COLOURS, strict=False):
        if len(track.targets):
            axes.plot(*thinned(track.target_times, track.targets), color=colour, linewidth=0.8, linestyle=(0, (3, 2)))
        axes.plot(*thinned(track.times, track.positions), color=colour)
    left_out = len(tracks) - len(drawn)
    still = sum(track.travel < STILL for track in tracks)
    words = [f"{left_out} more"] if left_out else []
    if left_out and still:
        words = [f"{left_out} more, of which {still} stand still" if still < left_out else f"{left_out} stand still"]
    axes.set_title(" ".join([group, *(f"({word})" for word in words)]))
    axes.set_ylabel(_UNITS.get(drawn[0].unit, drawn[0].unit))
    axes.margins(y=0.08)
    named = [(track.name, float(track.positions[-1]), colour) for track, colour in zip(drawn, COLOURS, strict=False)]
    name_at_the_end(axes, named)
    mark_collisions(axes, collisions)
    legend = ["dashed: target"] if any(len(track.targets) for track in drawn) else []
    legend += ["\N{MULTIPLICATION SIGN} grey: collision"] if collisions else []
    axes.text(1.0, 1.03, "   ".join(legend), transform=axes.transAxes, ha="right", fontsize=7, color=FAINT)


def joints_to_draw(tracks: Sequence[JointTrack]) -> list[JointTrack]:
    """Select the joints to draw: those that move, at most `MAX_JOINTS`, in their own order."""
    moving = [track for track in tracks if track.travel >= STILL] or list(tracks[:1])
    largest = sorted(moving, key=lambda track: -track.travel)[:MAX_JOINTS]
    return [track for track in moving if any(track is each for each in largest)]


def draw_score(axes: Axes, score: ScoreTrack, data: PlotData) -> None:
    """Draw the score as stairs; the time limits of the axes are set."""
    times = np.append(score.times, max(data.end, score.times[-1]))
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
    for mark in data.marks:
        axes.axvline(mark.time, color=FAINT, linewidth=0.6)
    label_marks(axes, data.marks)


def draw_from_above(axes: Axes, tools: Sequence[ToolTrack], collisions: Sequence[CollisionSpan] = ()) -> None:
    """Draw paths from above: x to the right and y up, or y to the left and x up if that fits the page better.

    A cross is where an arm's tool was when a collision of it began; the first one's, where the arm is not known.
    """
    extent = np.ptp(np.concatenate([tool.positions[:, :2] for tool in tools]), axis=0)
    across, up = (1, 0) if extent[1] > extent[0] else (0, 1)
    for tool, colour in zip(tools, cycle(COLOURS), strict=False):
        step = max(1, len(tool.times) // _POINTS)
        times, at = tool.times[::step], tool.positions[::step]
        colour, label = (FAINT, None) if _is_only_cup(tools) else (colour, tool.name)
        axes.plot(at[:, across], at[:, up], color=colour, linewidth=0.8, label=label)
        carried = _inside(times, tool.attached)
        if carried.any():
            there = np.where(carried[:, np.newaxis], at, np.nan)
            axes.plot(there[:, across], there[:, up], color=_LOADED, linewidth=1.6, label="carries a part")
        for span in tool.attached:
            _dot(axes, tool, span.begin, (across, up), "^", "picked up")
            if span.end < tool.times[-1]:
                _dot(axes, tool, span.end, (across, up), "v", "let go")
    for span in collisions:
        for tool in tools[:1] if not span.owner else [each for each in tools if each.arm == span.owner]:
            _dot(axes, tool, span.begin, (across, up), "X", "collision")
    axes.set_title("Tool from above" if len(tools) == 1 else "Tools from above")
    axes.set_xlabel(f"{'xy'[across]} [m] in {tools[0].frame}")
    axes.set_ylabel(f"{'xy'[up]} [m]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.06)
    if across:
        # y to the left of x, as seen from above
        axes.invert_xaxis()
    _legend(axes)


def draw_height(axes: Axes, tools: Sequence[ToolTrack], collisions: Sequence[Span] = ()) -> None:
    """Draw heights over time, with bars below for suction and for a carried part, and the collisions by name.

    The bars of several tools stand above each other, in the order of the legend from below.
    """
    for number, (tool, colour) in enumerate(zip(tools, cycle(COLOURS), strict=False)):
        times, height = thinned(tool.times, tool.positions[:, 2])
        colour, name = (INK, None) if _is_only_cup(tools) else (colour, tool.name)
        axes.plot(times, height, color=colour, label=name)
        low = 0.08 * number
        strips = ((tool.on, low, _SUCTION_ON, "suction on"), (tool.attached, low + 0.035, _LOADED, "carries a part"))
        for spans, place, strip, label in strips:
            for span in spans:
                axes.axvspan(span.begin, span.end, place, place + 0.03, color=strip, linewidth=0, label=label)
    axes.margins(y=0.12)
    axes.set_title("Tool height" if len(tools) == 1 else "Heights of the tools")
    axes.set_ylabel("z [m]")
    if collisions:
        low, high = axes.get_ylim()
        axes.set_ylim(low, high + 0.9 * (high - low))  # room for their names above the curves
    mark_collisions(axes, collisions, "collision")
    label_marks(axes, [Mark(span.begin, span.label) for span in collisions])
    _legend(axes)


def _is_only_cup(tools: Sequence[ToolTrack]) -> bool:
    """Return whether the only tool is a cup, whose marks say what it is."""
    return len(tools) == 1 and bool(tools[0].on or tools[0].attached)


def _inside(times: Array, spans: Sequence[Span]) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    found = np.zeros(len(times), bool)
    for span in spans:
        found |= (times >= span.begin) & (times <= span.end)
    return found


def _dot(axes: Axes, tool: ToolTrack, time: float, along: tuple[int, int], marker: str, label: str) -> None:
    x, y = (float(np.interp(time, tool.times, tool.positions[:, axis])) for axis in along)
    look: dict[str, Any] = {"markersize": 5.5, "markeredgewidth": 0.6, "markeredgecolor": "white", "linestyle": ""}
    axes.plot([x], [y], marker=marker, color=_LOADED if marker == "^" else INK, label=label, zorder=3, **look)


def _legend(axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    if once:
        is_wide = sum(map(len, once)) > _LEGEND
        axes.legend(
            once.values(),
            once.keys(),
            loc="upper left"
            if is_wide
            else "lower right",  # corner of the legend, which stands beside or above the drawing
            bbox_to_anchor=(1.01, 1.0) if is_wide else (1.0, 1.0),
            ncols=1 if is_wide else 4,
            borderpad=0,
            handlelength=1.4,
        )
