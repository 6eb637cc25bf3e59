"""A picture of how joints followed their targets, as an SVG file: for each joint its positions, and the error below."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from xml.sax.saxutils import escape

import numpy as np

from cellwright.operators.exercise import Exercise
from cellwright.operators.tracking import Array

WIDTH = 900
"""Of the picture [px]."""

_LEFT, _RIGHT, _TOP = 70, 20, 34
_HIGH, _LOW, _GAP = 200, 80, 44  # heights of the two frames, and what is below each
_MOST_POINTS = 4000
_TOLD, _SEEN, _ERROR = "#d9822b", "#1f5fa8", "#a82a2a"


def picture(exercises: Sequence[Exercise]) -> str:
    """The text of the file; one pair of frames below another."""
    pair = _TOP + _HIGH + _GAP + _LOW + _GAP
    parts = [_pair(each, top=number * pair) for number, each in enumerate(exercises)]
    size = f'width="{WIDTH}" height="{len(parts) * pair}" viewBox="0 0 {WIDTH} {len(parts) * pair}"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif" font-size="12">'
    return "\n".join([head, '<rect width="100%" height="100%" fill="white"/>', *parts, "</svg>", ""])


def _pair(exercise: Exercise, top: int) -> str:
    trace, figures = exercise.trace, exercise.tracking
    end = float(max(trace.told_at[-1], trace.seen_at[-1]))
    delay = "did not follow" if figures.delay is None else f"delay {figures.delay * 1e3:.0f} ms"
    title = f"{trace.joint}: {exercise.wave.shape}, RMS error {figures.rms:.4f}, greatest {figures.worst:.4f}, {delay}"
    told_at, told = _stairs(trace.told_at, trace.told)
    curves = [(told_at, told, _TOLD), (trace.seen_at, trace.seen, _SEEN)]
    legend = "".join(
        f'<text x="{WIDTH - _RIGHT - right}" y="{top + 22}" text-anchor="end" fill="{colour}">{text}</text>'
        for right, text, colour in ((130, "target", _TOLD), (62, "measured", _SEEN), (0, "[rad; m]", "#000"))
    )
    error = [(trace.seen_at, trace.target - trace.seen, _ERROR)]
    return "\n".join(
        [
            f'<text x="{_LEFT}" y="{top + 22}" font-weight="bold">{escape(title)}</text>',
            legend,
            _frame(curves, end, top + _TOP, _HIGH),
            _frame(error, end, top + _TOP + _HIGH + _GAP, _LOW, label="error [rad; m]", time_below=True),
        ]
    )


def _frame(
    curves: Iterable[tuple[Array, Array, str]],
    end: float,
    top: int,
    height: int,
    *,
    label: str = "",
    time_below: bool = False,
) -> str:
    """A frame with curves in it, from time 0 to `end` [s]."""
    chosen = [(time[_thin(time)], values[_thin(time)], colour) for time, values, colour in curves]
    low = min(float(values.min()) for _, values, _ in chosen)
    high = max(float(values.max()) for _, values, _ in chosen)
    space = max(0.05 * (high - low), 1e-6)
    low, high = low - space, high + space
    width = WIDTH - _LEFT - _RIGHT
    parts = []
    for value in _ticks(low, high, max(6, height // 45)):
        y = top + height * (high - value) / (high - low)
        parts += [
            f'<path d="M{_LEFT} {y:.1f}h{width}" stroke="#ddd"/>',
            f'<text x="{_LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{_number(value)}</text>',
        ]
    for value in _ticks(0.0, end, 8):
        x = _LEFT + width * value / end
        parts += [
            f'<path d="M{x:.1f} {top}v{height}" stroke="#ddd"/>',
            f'<text x="{x:.1f}" y="{top + height + 16}" text-anchor="middle">{_number(value)}</text>',
        ]
    parts.append(f'<rect x="{_LEFT}" y="{top}" width="{width}" height="{height}" fill="none" stroke="#888"/>')
    for time, values, colour in chosen:
        points = zip(_LEFT + width * time / end, top + height * (high - values) / (high - low), strict=True)
        line = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        parts.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="1.5"/>')
    if label:
        parts.append(f'<text x="{_LEFT}" y="{top - 5}" fill="{_ERROR}">{label}</text>')
    if time_below:
        parts.append(f'<text x="{WIDTH - _RIGHT}" y="{top + height + 32}" text-anchor="end">time [s]</text>')
    return "\n".join(parts)


def _stairs(time: Array, values: Array) -> tuple[Array, Array]:
    """A value is in force until the next: points of the stairs."""
    return np.repeat(time, 2)[1:], np.repeat(values, 2)[:-1]


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
