"""A picture of how joints followed their targets, as an SVG file: for each joint its positions, and the error below."""

from __future__ import annotations

from collections.abc import Sequence
from xml.sax.saxutils import escape

import numpy as np

from cellwright.clients.operators.exercise import Exercise
from cellwright.clients.operators.svg_frame import LEFT, RIGHT, WIDTH, frame, page
from cellwright.clients.operators.tracking import Array

_TOP = 34
_HIGH, _LOW, _GAP = 200, 80, 44  # heights of the two frames, and what is below each
_TOLD, _SEEN, _ERROR = "#d9822b", "#1f5fa8", "#a82a2a"


def picture(exercises: Sequence[Exercise]) -> str:
    """The text of the file; one pair of frames below another."""
    pair = _TOP + _HIGH + _GAP + _LOW + _GAP
    parts = [_pair(each, top=number * pair) for number, each in enumerate(exercises)]
    return page(parts, len(parts) * pair)


def _pair(exercise: Exercise, top: int) -> str:
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
