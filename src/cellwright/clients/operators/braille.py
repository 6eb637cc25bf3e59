"""A plot of curves in the characters of a terminal: each Braille character is 2 by 4 dots."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from rich.text import Text

from cellwright.clients.operators.tracking import Array

_BLANK = 0x2800
_DOTS = ((0x01, 0x02, 0x04, 0x40), (0x08, 0x10, 0x20, 0x80))  # by column, from the top


@dataclass(frozen=True)
class Curve:
    """Values against time [s], in one colour of the terminal."""

    name: str
    time: Array
    values: Array
    colour: str


def plot(curves: Sequence[Curve], *, width: int = 72, height: int = 12, unit: str = "") -> Text:
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
        x = _scaled(curve.time, begin, end, 2 * columns)
        y = 4 * height - 1 - _scaled(curve.values, low, high, 4 * height)
        for column, row in _line(x, y):
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


def _scaled(values: Array, low: float, high: float, count: int) -> np.ndarray[tuple[int, ...], np.dtype[np.int_]]:
    """The dot of each value, 0 to count - 1; the middle where all are the same."""
    if high - low < 1e-12:
        return np.full(len(values), count // 2)
    return np.clip(np.rint((values - low) / (high - low) * (count - 1)), 0, count - 1).astype(int)


def _line(
    x: np.ndarray[tuple[int, ...], np.dtype[np.int_]], y: np.ndarray[tuple[int, ...], np.dtype[np.int_]]
) -> set[tuple[int, int]]:
    """The dots of a line through points."""
    dots = {(int(x[0]), int(y[0]))}
    for x0, y0, x1, y1 in zip(x[:-1], y[:-1], x[1:], y[1:], strict=True):
        steps = max(abs(int(x1) - int(x0)), abs(int(y1) - int(y0)), 1)
        for column, row in zip(np.linspace(x0, x1, steps + 1), np.linspace(y0, y1, steps + 1), strict=True):
            dots.add((round(column), round(row)))
    return dots
