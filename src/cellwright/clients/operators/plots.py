"""Plots of tracking: curves in terminal characters, and SVG files."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from io import StringIO
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from rich.text import Text

from cellwright.clients.operators.exercise import Array, Exercise
from cellwright.util.errors import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_BLANK = 0x2800
_DOTS = np.array([(0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80)])  # bits of a character's dots, by row
_TARGET_COLOUR, _MEASURED_COLOUR, _ERROR_COLOUR = "#d9822b", "#1f5fa8", "#a82a2a"
_MAX_POINTS = 4000  # of a curve


@dataclass(frozen=True)
class Curve:
    """Values against time [s], in one colour of the terminal."""

    name: str
    time: Array
    values: Array
    colour: str


def terminal_plot(curves: Sequence[Curve], *, width: int = 72, height: int = 12, unit: str = "") -> Text:
    """Return the curves in one frame of `width` by `height` characters, with the ends of both axes written at it.

    The time axis takes one more line. There is at least one curve, each with at least one value. Where two meet in one
    character it has the colour of the later one.
    """
    low = min(float(curve.values.min()) for curve in curves)
    high = max(float(curve.values.max()) for curve in curves)
    begin = min(float(curve.time[0]) for curve in curves)
    end = max(float(curve.time[-1]) for curve in curves)
    labels = [f"{value if abs(value) > 1e-6 * (high - low) else 0.0:.3g}" for value in (high, low)]
    margin = max(map(len, labels))
    columns = max(8, width - margin - 1)
    dots = np.zeros((4 * height, 2 * columns), dtype=int)
    colours = np.full((height, columns), -1)
    for number, curve in enumerate(curves):
        x = _dot_numbers(curve.time, begin, end, 2 * columns)
        y = 4 * height - 1 - _dot_numbers(curve.values, low, high, 4 * height)
        points = np.column_stack((x, y))
        lines = [np.linspace(one, other, max(1, np.abs(other - one).max()) + 1) for one, other in pairwise(points)]
        x, y = np.rint(np.concatenate((points[:1], *lines))).astype(int).T
        dots[y, x] = 1
        colours[y // 4, x // 2] = number
    cells = np.einsum("irjc,rc->ij", dots.reshape(height, 4, columns, 2), _DOTS)
    text = Text(no_wrap=True)
    for row in range(height):
        label = labels[0] if row == 0 else labels[1] if row == height - 1 else ""
        text.append(f"{label:>{margin}}┤" if label else f"{'':>{margin}}│", style="dim")
        for cell, number in zip(cells[row], colours[row], strict=True):
            text.append(chr(_BLANK + int(cell)), style=curves[number].colour if number >= 0 else "")
        text.append("\n")
    left, right = f"{round(begin, 2):g} s", f"{round(end, 2):g} s"
    text.append(f"{'':>{margin}} {left}{right:>{max(1, columns - len(left))}}\n", style="dim")
    text.append(" " * (margin + 1))
    for number, curve in enumerate(curves):
        text.append("  " if number else "").append("━ ", style=curve.colour).append(curve.name)
    return text.append(f" [{unit}]" if unit else "")


def _dot_numbers(values: Array, low: float, high: float, count: int) -> np.ndarray[tuple[int, ...], np.dtype[np.int_]]:
    """Return the dot of each value, 0 to count - 1; the middle where all are the same."""
    if high - low < 1e-12:
        return np.full(len(values), count // 2)
    return np.clip(np.rint((values - low) / (high - low) * (count - 1)), 0, count - 1).astype(int)


def tracking_svg(exercises: Sequence[Exercise]) -> str:
    """Return the text of an SVG file: target and position of each joint, and the error below them."""
    from matplotlib.figure import Figure

    count = len(exercises)
    figure = Figure(figsize=(9.0, 3.8 * count), layout="constrained")
    frames = figure.subplots(2 * count, 1, height_ratios=[5, 2] * count)
    for each, motion, error in zip(exercises, frames[::2], frames[1::2], strict=True):
        trace, figures = each.trace, each.tracking
        targets, seen = (
            slice(None, None, max(1, len(time) // _MAX_POINTS)) for time in (trace.target_times, trace.measured_times)
        )
        motion.step(trace.target_times[targets], trace.targets[targets], _TARGET_COLOUR, where="post", label="target")
        motion.plot(trace.measured_times[seen], trace.measured[seen], _MEASURED_COLOUR, label="measured")
        error.plot(trace.measured_times[seen], (trace.target_in_force - trace.measured)[seen], _ERROR_COLOUR)
        delay = "did not follow" if figures.delay is None else f"delay {figures.delay * 1e3:.0f} ms"
        errors = f"RMS error {figures.rms:.4f}, greatest {figures.worst:.4f}"
        title = f"{printable(trace.joint)}: {each.wave.shape}, {errors}, {delay}"
        motion.set_title(title, loc="left", size="medium", weight="bold", parse_math=False)
        motion.set_ylabel("[rad; m]")
        motion.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0, ncols=2, frameon=False)
        error.set_ylabel("error", color=_ERROR_COLOUR)
        error.set_xlabel("time [s]")
        for frame in (motion, error):
            frame.set_xlim(0.0, max(trace.target_times[-1], trace.measured_times[-1]))
            frame.grid(color="#ddd")
    return svg_text(figure)


def svg_text(figure: Figure) -> str:
    """Return a figure as the text of an SVG file, the same for the same figure."""
    import matplotlib as mpl

    text = StringIO()
    with mpl.rc_context({"svg.hashsalt": "cellwright", "svg.fonttype": "none"}), warnings.catch_warnings():
        # A joint's name may have characters that the font has not.
        warnings.filterwarnings("ignore", "Glyph ")
        figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()
