"""Charts of a recording: score, trays, joints, tool and commands, and the style they share."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from cellwright.recording.plots.tracks import (
    Array,
    JointTrack,
    Mark,
    PlotData,
    ScoreTrack,
    Span,
    ToolTrack,
    TrackedTrayPart,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#555555")
"""Colours of curves, in this order (Okabe and Ito's, without their yellow, which does not print)."""

INK, FAINT, GRID = "#222222", "#888888", "#DDDDDD"

VERDICTS = {
    "": ("#9AA5AE", ""),
    "right": ("#009E73", ""),
    "faulty": ("#D55E00", "////"),
    "not ordered": ("#E69F00", "...."),
}
"""Colour and hatching of a part on a tray, by its verdict; the hatching distinguishes them in grey."""

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
MAX_JOINTS = len(COLOURS)
"""Maximum number of curves that a reader can distinguish; of more joints, those that move most are drawn."""
STILL = 1e-3
"""Range of motion [rad; m] below which a joint stands still."""
_UNITS = {"rad": "position [rad]", "m": "position [m]"}
_LABEL_ROWS = 4  # rows of labels, for events close in time
_LOADED, _SUCTION_ON = "#D55E00", "#0072B2"
_LEGEND = 60  # maximum characters of a legend beside the title
_POINTS = 20_000  # maximum points of a path from above, which cannot be thinned by time
MAX_COMMANDS = 12
"""Maximum number of rows of commands; the most frequent ones are drawn."""
_SLICES = 400
_LIGHT = 0.35
_BLUE = (0.0, 0.447, 0.698)
MAX_PARTS = 40
"""Maximum number of bars of each tray; the first ones are drawn."""


def name_at_the_end(axes: Axes, named: list[tuple[str, float, str]]) -> None:
    """Write names of curves at their right ends, without overlaps.

    Args:
        axes: with final limits.
        named: of each curve its name, its value at the end, and its colour.
    """
    low, high = axes.get_ylim()
    box = axes.get_window_extent()
    min_gap = 1.35 * SIZE_OF_NAMES * axes.figure.dpi / 72.0 / max(box.height, 1.0) * (high - low)
    ordered = sorted(named, key=lambda each: each[1])
    heights = [value for _, value, _ in ordered]
    for _ in range(200):  # each pushes its neighbours away until all fit
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
    for filled, pick in ((np.inf, np.argmin), (-np.inf, np.argmax)):
        whole = np.where(is_gap, filled, values)
        chosen = [low + int(pick(whole[low:high])) for low, high in pairwise(bounds)]
        kept.append(np.array(chosen))
    gaps = np.flatnonzero(is_gap & ~np.concatenate(([False], is_gap[:-1])))  # begin of each gap
    places = np.unique(np.concatenate([*kept, gaps]))
    return times[places], values[places]


def joints_to_draw(tracks: Sequence[JointTrack]) -> list[JointTrack]:
    """Select the joints to draw: those that move, at most `MAX_JOINTS`, in their own order."""
    moving = [track for track in tracks if track.travel >= STILL] or list(tracks[:1])
    largest = sorted(moving, key=lambda track: -track.travel)[:MAX_JOINTS]
    return [track for track in moving if any(track is each for each in largest)]


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


def mark_collisions(axes: Axes, collisions: Sequence[Span], label: str | None = None) -> None:
    """Shade the periods of collisions, with a cross above the begin of each: a short one is narrower than a pixel."""
    for span in collisions:
        axes.axvspan(span.begin, span.end, color=FAINT, alpha=0.25, linewidth=0)
    if collisions:
        begins = [span.begin for span in collisions]
        look: dict[str, Any] = {"marker": "x", "markersize": 4.5, "markeredgewidth": 1.2, "linestyle": ""}
        where = axes.get_xaxis_transform()
        axes.plot(begins, [0.97] * len(begins), color=INK, transform=where, clip_on=False, label=label, **look)


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
    _label_marks(axes, data.marks)


def _label_marks(axes: Axes, marks: Sequence[Mark]) -> None:
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
            continue  # it is drawn without its label: no row has room
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


def draw_from_above(axes: Axes, tools: Sequence[ToolTrack], collisions: Sequence[Span] = ()) -> None:
    """Draw paths from above: x to the right and y up, or y to the left and x up if that fits the page better.

    A cross is where the first tool was when a collision began.
    """
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
    for span in collisions:
        _dot(axes, tools[0], span.begin, (across, up), "X", "collision")
    axes.set_title("Tool from above" if len(tools) == 1 else "Tools from above")
    axes.set_xlabel(f"{'xy'[across]} [m] in {tools[0].frame}")
    axes.set_ylabel(f"{'xy'[up]} [m]")
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.06)
    if across:
        axes.invert_xaxis()  # y to the left of x, as seen from above
    _legend(axes)


def draw_height(axes: Axes, tools: Sequence[ToolTrack], collisions: Sequence[Span] = ()) -> None:
    """Draw heights over time, with bars below for suction and for a carried part, and the collisions by name."""
    for tool, colour in zip(tools, COLOURS, strict=False):
        has_cup = bool(tool.on or tool.attached)
        times, height = thinned(tool.times, tool.positions[:, 2])
        axes.plot(times, height, color=INK if has_cup else colour, label=None if has_cup else tool.name)
        strips = ((tool.on, 0.0, _SUCTION_ON, "suction on"), (tool.attached, 0.035, _LOADED, "carries a part"))
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
    _label_marks(axes, [Mark(span.begin, span.label) for span in collisions])
    _legend(axes)


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


def _inside(times: Array, spans: Sequence[Span]) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    found = np.zeros(len(times), bool)
    for span in spans:
        found |= (times >= span.begin) & (times <= span.end)
    return found


def _dot(axes: Axes, tool: ToolTrack, time: float, along: tuple[int, int], marker: str, label: str) -> None:
    x, y = (float(np.interp(time, tool.times, tool.positions[:, axis])) for axis in along)
    look: dict[str, Any] = {"markersize": 5.5, "markeredgewidth": 0.6, "markeredgecolor": "white", "linestyle": ""}
    axes.plot([x], [y], marker=marker, color=_LOADED if marker == "^" else INK, label=label, zorder=3, **look)


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
    _finish_rows(axes, row, "States and commands" if data.states else "Commands")


def _finish_rows(axes: Axes, rows: int, title: str) -> None:
    """Set up an axis of rows, the first at the top."""
    axes.set_ylim(max(rows, 1) - 0.5, -0.5)
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.set_title(title)


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
    _finish_rows(axes, row, "On the trays")
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
