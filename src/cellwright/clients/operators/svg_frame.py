"""Curves in a frame with ticks, as a piece of an SVG file, and the file around such pieces."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

Array = np.ndarray[tuple[int, ...], np.dtype[np.float64]]

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
    curves: Iterable[tuple[Array, Array, str]],
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
            f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{_number(value)}</text>',
        ]
    for value in _ticks(0.0, end, 8):
        x = LEFT + width * value / end
        parts += [
            f'<path d="M{x:.1f} {top}v{height}" stroke="#ddd"/>',
            f'<text x="{x:.1f}" y="{top + height + 16}" text-anchor="middle">{_number(value)}</text>',
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


def _thin(time: Array) -> slice:
    return slice(None, None, max(1, len(time) // _MOST_POINTS))


def _ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers in a range, `most` of them or fewer."""
    rough = (high - low) / most
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(factor * power for factor in (1, 2, 5, 10) if factor * power >= rough)
    return [number * step for number in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _number(value: float) -> str:
    return f"{value:.6g}"
