"""The smooth curve through given points: a cubic spline, as the velocities at its knots."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from cellwright.motion.joints import Joints


def knot_velocities(
    times: Sequence[float],
    positions: Sequence[Joints],
    first: Joints | None = None,
    last: Joints | None = None,
) -> tuple[Joints, ...]:
    """The velocities [rad/s; m/s] at the knots with which the cubics between them have no jump in acceleration.

    Args:
        times: of the knots, rising; at least two.
        positions: at the knots.
        first: velocity at the first knot; when left out there is no acceleration there.
        last: the same for the last knot.
    """
    columns = [
        _column(
            times,
            [position[joint] for position in positions],
            None if first is None else first[joint],
            None if last is None else last[joint],
        )
        for joint in range(len(positions[0]))
    ]
    return tuple(Joints(*row) for row in zip(*columns, strict=True))


def _column(times: Sequence[float], values: Sequence[float], first: float | None, last: float | None) -> list[float]:
    """The velocities of one joint: a tridiagonal system, solved from the front to the back and back (Thomas)."""
    steps = [b - a for a, b in pairwise(times)]
    slopes = [(b - a) / step for a, b, step in zip(values, values[1:], steps, strict=False)]
    # A row says: below * v[i-1] + middle * v[i] + above * v[i+1] = right.
    rows = [(0.0, 2.0, 1.0, 3.0 * slopes[0]) if first is None else (0.0, 1.0, 0.0, first)]
    for h0, h1, d0, d1 in zip(steps, steps[1:], slopes, slopes[1:], strict=False):
        rows.append((h1, 2.0 * (h0 + h1), h0, 3.0 * (h1 * d0 + h0 * d1)))
    rows.append((1.0, 2.0, 0.0, 3.0 * slopes[-1]) if last is None else (0.0, 1.0, 0.0, last))
    forward: list[tuple[float, float]] = []
    ratio, value = 0.0, 0.0
    for below, middle, above, right in rows:
        pivot = middle - below * ratio
        ratio, value = above / pivot, (right - below * value) / pivot
        forward.append((ratio, value))
    velocities = [0.0] * len(rows)
    following = 0.0
    for index in range(len(rows) - 1, -1, -1):
        ratio, value = forward[index]
        following = value - ratio * following
        velocities[index] = following
    return velocities
