"""Figure of a recording: charts over one time axis on a page, written as PNG, SVG or PDF."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cellwright.recording.plots import bars, curves
from cellwright.recording.plots.style import INK, SETTINGS
from cellwright.recording.plots.tracks import PlotData
from cellwright.util.errors import UsageError, printable
from cellwright.util.files import write_atomic

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.transforms import Bbox

FIGURE_SUFFIXES = (".png", ".svg", ".pdf")
"""Suffixes of the files that can be written."""

PANELS = ("score", "trays", "joints", "tool", "commands")
"""Panels of a figure, in their order on the page."""

_WIDTH = 8.27  # width of the page [in]: A4
_LEFT, _RIGHT = 1.3, 0.9  # margins [in]: names of rows, names of curves
_HEAD, _FOOT, _GAP = 0.86, 0.5, 0.42  # above, below and between the drawings [in]
_DPI = 160
_MAX_TEXT = 200  # characters of a text; of a longer one the middle is left out
_TITLE = 60  # characters of a title that fit the width of the page
_PAD = 0.08  # margin of a text for which the page is widened [in]
_FROM_ABOVE = 2.7  # height of the path from above [in]
_AXIS = 0.3  # additional room for the figures and the name below an axis [in]


@dataclass(frozen=True)
class _Panel:
    """One panel: its height [in], its drawing function, and whether it has the time axis."""

    height: float
    draw: Callable[[Axes], None]
    is_over_time: bool = True


def draw_figure(data: PlotData, panels: Sequence[str] = PANELS) -> Figure:
    """Draw the page, with panels by name (see `PANELS`).

    Raises:
        UsageError: the recording has nothing to draw in these panels.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    drawn = [panel for name in PANELS if name in panels for panel in _panels(data, name)]
    drawn.sort(key=lambda panel: not panel.is_over_time)
    if not drawn:
        raise UsageError(f"{data.title}: has nothing to plot in {', '.join(panels)}")
    with mpl.rc_context(SETTINGS):
        last = sum(panel.is_over_time for panel in drawn) - 1
        gaps = [_GAP + _AXIS * (number == last) for number in range(len(drawn) - 1)]
        height = _HEAD + sum(panel.height for panel in drawn) + sum(gaps) + _FOOT
        figure = Figure(figsize=(_WIDTH, height), dpi=_DPI)
        left, size = _LEFT / _WIDTH, 13.0 * min(1.0, _TITLE / max(len(data.title), 1))  # smaller for a long title
        figure.text(left, 1.0 - 0.24 / height, data.title, fontsize=size, fontweight="bold", va="center")
        figure.text(left, 1.0 - 0.46 / height, data.note, fontsize=8, color=INK, va="center")
        top = height - _HEAD
        for number, (panel, gap) in enumerate(zip(drawn, [*gaps, 0.0], strict=True)):
            width = 1 - (_LEFT + _RIGHT) / _WIDTH
            axes = figure.add_axes((left, (top - panel.height) / height, width, panel.height / height))
            if panel.is_over_time:
                axes.set_xlim(data.begin, max(data.end, data.begin + 1e-9))
                axes.autoscale(enable=False, axis="x")
                axes.tick_params(axis="x", labelbottom=number == last)
            panel.draw(axes)
            if number == last:
                axes.set_xlabel("simulation time [s]")
            top -= panel.height + gap
    return figure


def write_figure(figure: Figure, path: Path) -> None:
    """Write a page into a file atomically; its suffix gives the format.

    Raises:
        OSError: it cannot be written.
    """
    import matplotlib as mpl
    from matplotlib.text import Text

    for words in figure.findobj(Text):  # recordings are untrusted
        words.set_text(_shown(words.get_text()))
    buffer = BytesIO()
    kind = path.suffix.lower().removeprefix(".")
    made: dict[str, Any] = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
    with mpl.rc_context({**SETTINGS, "svg.hashsalt": "cellwright"}), warnings.catch_warnings():
        # a character that the font lacks is drawn as a box
        warnings.filterwarnings("ignore", "Glyph ")
        figure.savefig(buffer, format=kind, facecolor="white", metadata=made[kind], bbox_inches=_page(figure))
    write_atomic(path, buffer.getvalue())


def _page(figure: Figure) -> Bbox | None:
    """Return the page [in] widened so that all names fit; None if they fit already."""
    from matplotlib.transforms import Bbox

    width, height = figure.get_size_inches()
    needed = figure.get_tightbbox()
    left, right = min(0.0, needed.x0 - _PAD), max(width, needed.x1 + _PAD)
    return None if (left, right) == (0.0, width) else Bbox([[left, 0.0], [right, height]])


def _shown(text: str) -> str:
    """Make a text of an untrusted recording fit to be drawn."""
    line = printable(text, 10 * _MAX_TEXT)
    half = (_MAX_TEXT - 1) // 2
    return line if len(line) <= _MAX_TEXT else f"{line[:half]}…{line[-half:]}"


def _panels(data: PlotData, name: str) -> list[_Panel]:
    """Return the panels of one of the names in `PANELS`; empty if there is nothing to draw."""
    match name:
        case "score" if data.score is not None and len(data.score.times):
            found = data.score
            return [_Panel(1.35, lambda axes: curves.draw_score(axes, found, data))]
        case "trays" if data.tray_parts:
            return [_Panel(0.17 * bars.tray_rows(data) + 0.1, lambda axes: bars.draw_trays(axes, data))]
        case "joints":
            return _joints(data)
        case "tool" if any(len(each.times) for each in data.tools):
            tools = [each for each in data.tools if len(each.times)]
            return [
                _Panel(1.9 if data.collisions else 1.25, lambda axes: curves.draw_height(axes, tools, data.collisions)),
                _Panel(
                    _FROM_ABOVE, lambda axes: curves.draw_from_above(axes, tools, data.collisions), is_over_time=False
                ),
            ]
        case "commands" if bars.command_rows(data):
            return [_Panel(0.17 * bars.command_rows(data) + 0.1, lambda axes: bars.draw_commands(axes, data))]
        case _:
            return []


def _joints(data: PlotData) -> list[_Panel]:
    """Return a panel for each unit of each group in which a joint moves; only the first if none does."""
    groups = [
        (group, [track for track in tracks if track.unit == unit and len(track.times)])
        for group, tracks in data.joints.items()
        for unit in dict.fromkeys(track.unit for track in tracks if len(track.times))
    ]
    moving = [each for each in groups if any(track.travel >= curves.STILL for track in each[1])] or groups[:1]
    drawn = []
    for group, tracks in moving:
        is_one = len(tracks) == 1
        title = f"{group}: {tracks[0].name}" if is_one and len(data.joints[group]) > 1 else group
        draw = partial(curves.draw_joints, group=title, tracks=tracks, collisions=data.collisions)
        drawn.append(_Panel(0.9 if is_one else 1.7, draw))
    return drawn
