"""Plots of tracking: curves in terminal characters, and SVG files."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape

import numpy as np
from rich.text import Text

from cellwright.clients.operators.exercise import Array, Exercise

_BLANK = 0x2800
_DOTS = ((0x01, 0x02, 0x04, 0x40), (0x08, 0x10, 0x20, 0x80))  # by column, from the top


@dataclass(frozen=True)
class Curve:
    """Values against time [s], in one colour of the terminal."""

    name: str
    time: Array
    values: Array
    colour: str


def terminal_plot(curves: Sequence[Curve], *, width: int = 72, height: int = 12, unit: str = "") -> Text:
    """The curves in one frame of `width` by `height` characters, with the ends of both axes written at it.

    Where two curves meet in one character it has the colour of the later one.

    Args:
        curves: at least one; each with a value at least.
        width: of the whole [characters].
        height: of the frame [lines]; the time stands below it.
        unit: of the values.
    """
    low = min(float(curve.values.min()) for curve in curves)
    high = max(float(curve.values.max()) for curve in curves)
    begin = min(float(curve.time[0]) for curve in curves)
    end = max(float(curve.time[-1]) for curve in curves)
    labels = [f"{value if abs(value) > 1e-6 * (high - low) else 0.0:.3g}" for value in (high, low)]
    margin = max(map(len, labels))
    columns = max(8, width - margin - 1)
    cells = np.zeros((height, columns), dtype=int)
    colours = np.full((height, columns), -1)
    for number, curve in enumerate(curves):
        x = _dot_numbers(curve.time, begin, end, 2 * columns)
        y = 4 * height - 1 - _dot_numbers(curve.values, low, high, 4 * height)
        for column, row in _line_dots(x, y):
            cells[row // 4, column // 2] |= _DOTS[column % 2][row % 4]
            colours[row // 4, column // 2] = number
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
    """The dot of each value, 0 to count - 1; the middle where all are the same."""
    if high - low < 1e-12:
        return np.full(len(values), count // 2)
    return np.clip(np.rint((values - low) / (high - low) * (count - 1)), 0, count - 1).astype(int)


def _line_dots(
    x: np.ndarray[tuple[int, ...], np.dtype[np.int_]], y: np.ndarray[tuple[int, ...], np.dtype[np.int_]]
) -> set[tuple[int, int]]:
    """The dots of a line through points."""
    dots = {(int(x[0]), int(y[0]))}
    for x0, y0, x1, y1 in zip(x[:-1], y[:-1], x[1:], y[1:], strict=True):
        steps = max(abs(int(x1) - int(x0)), abs(int(y1) - int(y0)), 1)
        for column, row in zip(np.linspace(x0, x1, steps + 1), np.linspace(y0, y1, steps + 1), strict=True):
            dots.add((round(column), round(row)))
    return dots


FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

WIDTH = 900
"""Of the picture [px]."""
LEFT, RIGHT = 70, 20
"""Margins of a frame [px]."""

_MOST_POINTS = 4000


def page(parts: Sequence[str], height: int) -> str:
    """The text of a file `height` [px] high, with pieces in it."""
    size = f'width="{WIDTH}" height="{height}" viewBox="0 0 {WIDTH} {height}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif" font-size="12">'
    return "\n".join([head, '<rect width="100%" height="100%" fill="white"/>', *parts, "</svg>", ""])


def frame(
    curves: Iterable[tuple[FloatArray, FloatArray, str]],
    end: float,
    top: int,
    height: int,
    *,
    label: str = "",
    colour_of_label: str = "#000",
    below: str = "",
) -> str:
    """A frame with curves in it.

    Args:
        curves: times from 0 on, values, and colour of each.
        end: the time at the right edge.
        top: upper edge [px].
        height: of the frame [px].
        label: what the values are, above the frame.
        colour_of_label: its colour.
        below: what the times are, below the frame.
    """
    chosen = [(time[_thin(time)], values[_thin(time)], colour) for time, values, colour in curves]
    low = min(float(values.min()) for _, values, _ in chosen)
    high = max(float(values.max()) for _, values, _ in chosen)
    space = max(0.05 * (high - low), 1e-6)
    low, high = low - space, high + space
    width = WIDTH - LEFT - RIGHT
    parts = []
    for value in _ticks(low, high, max(6, height // 45)):
        y = top + height * (high - value) / (high - low)
        parts += [
            f'<path d="M{LEFT} {y:.1f}h{width}" stroke="#ddd"/>',
            f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{_tick_label(value)}</text>',
        ]
    for value in _ticks(0.0, end, 8):
        x = LEFT + width * value / end
        parts += [
            f'<path d="M{x:.1f} {top}v{height}" stroke="#ddd"/>',
            f'<text x="{x:.1f}" y="{top + height + 16}" text-anchor="middle">{_tick_label(value)}</text>',
        ]
    parts.append(f'<rect x="{LEFT}" y="{top}" width="{width}" height="{height}" fill="none" stroke="#888"/>')
    for time, values, colour in chosen:
        points = zip(LEFT + width * time / end, top + height * (high - values) / (high - low), strict=True)
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        parts.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="1.5"/>')
    if label:
        parts.append(f'<text x="{LEFT}" y="{top - 5}" fill="{colour_of_label}">{label}</text>')
    if below:
        parts.append(f'<text x="{WIDTH - RIGHT}" y="{top + height + 32}" text-anchor="end">{below}</text>')
    return "\n".join(parts)


def _thin(time: FloatArray) -> slice:
    return slice(None, None, max(1, len(time) // _MOST_POINTS))


def _ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers in a range, `most` of them or fewer."""
    rough = (high - low) / most
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(factor * power for factor in (1, 2, 5, 10) if factor * power >= rough)
    return [number * step for number in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _tick_label(value: float) -> str:
    return f"{value:.6g}"


_TOP = 34
_HIGH, _LOW, _GAP = 200, 80, 44  # heights of the two frames, and what is below each
_TOLD, _SEEN, _ERROR = "#d9822b", "#1f5fa8", "#a82a2a"


def tracking_svg(exercises: Sequence[Exercise]) -> str:
    """The text of the file; one pair of frames below another."""
    pair = _TOP + _HIGH + _GAP + _LOW + _GAP
    parts = [_joint_frames(each, top=number * pair) for number, each in enumerate(exercises)]
    return page(parts, len(parts) * pair)


def _joint_frames(exercise: Exercise, top: int) -> str:
    trace, figures = exercise.trace, exercise.tracking
    end = float(max(trace.told_at[-1], trace.seen_at[-1]))
    delay = "did not follow" if figures.delay is None else f"delay {figures.delay * 1e3:.0f} ms"
    title = f"{trace.joint}: {exercise.wave.shape}, RMS error {figures.rms:.4f}, greatest {figures.worst:.4f}, {delay}"
    told_at, told = _stairs(trace.told_at, trace.told)
    curves = [(told_at, told, _TOLD), (trace.seen_at, trace.seen, _SEEN)]
    legend = "".join(
        f'<text x="{WIDTH - RIGHT - right}" y="{top + 22}" text-anchor="end" fill="{colour}">{text}</text>'
        for right, text, colour in ((130, "target", _TOLD), (62, "measured", _SEEN), (0, "[rad; m]", "#000"))
    )
    error = [(trace.seen_at, trace.target - trace.seen, _ERROR)]
    return "\n".join(
        [
            f'<text x="{LEFT}" y="{top + 22}" font-weight="bold">{escape(title)}</text>',
            legend,
            frame(curves, end, top + _TOP, _HIGH),
            frame(
                error,
                end,
                top + _TOP + _HIGH + _GAP,
                _LOW,
                label="error [rad; m]",
                colour_of_label=_ERROR,
                below="time [s]",
            ),
        ]
    )


def _stairs(time: Array, values: Array) -> tuple[Array, Array]:
    """A value is in force until the next: points of the stairs."""
    return np.repeat(time, 2)[1:], np.repeat(values, 2)[:-1]
