"""The way of an AGV from its station to the dock behind the cell, and back.

The original moves an AGV through key frames with a spline whose tangent at a key frame is half the way from the
frame before to the frame after, counted per interval, however long the interval takes. Its speed therefore jumps, by
up to 0.8 m/s, wherever intervals of different length meet, and from and to standstill at the ends. Here the tangents
are velocities: the way from the frame before to the frame after over the time between those two, and zero at the
ends. So velocity is continuous from standstill to standstill, and what lies on the tray can follow. Every key frame
is reached when the original reaches it; between them the two differ by less than 0.08 m on the way out and 0.2 m on
the way back.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from math import hypot
from typing import Final, TypeAlias

from cellwright.cell.devices.trajectory.trajectory import Knot, Segment, Trajectory, join
from cellwright.engine.clock import NANOSECONDS
from cellwright.util.errors import UsageError

KeyFrames: TypeAlias = tuple[tuple[str, float, float], ...]
"""Time, and x and y of AGV 1 in the world frame [m], at each key frame."""

PACE: Final = Fraction(6, 5)
"""The times of the key frames are run through this much faster."""

DELIVER: Final[KeyFrames] = (
    ("0", 0.3, 3.3),
    ("1.5", -0.76, 3.3),
    ("3", -2.73, 3.3),
    ("4", -3.94, 3.6),
    ("5.3", -4.5, 4.4),
    ("6.5", -4.5, 5.3),
    ("7.7", -4.5, 6.3),
    ("9", -4.2, 8.0),
    ("10", -4.2, 8.3),
)
RETURN: Final[KeyFrames] = (
    ("0", -4.2, 8.3),
    ("2.6", -4.4, 6.4),
    ("3.8", -4.5, 5.2),
    ("5.4", -4.4, 4.1),
    ("6.8", -3.8, 3.5),
    ("7.9", -2.8, 3.3),
    ("9.4", -1.6, 3.3),
    ("12", 0.3, 3.3),
)


class AgvPath:
    """Where an AGV is, by the time since it set out; before and after its way it stands.

    Positions and velocities are those of the AGV's origin in the world frame, x and y. Its height and heading stay.
    """

    def __init__(self, frames: KeyFrames, agv: int) -> None:
        if agv not in (1, 2):
            raise UsageError(f"there is no AGV {agv}, only 1 and 2")
        times = [round(Fraction(time) / PACE * NANOSECONDS) for time, _, _ in frames]
        side = 1.0 if agv == 1 else -1.0
        self.duration = times[-1]
        """How long the way takes [ns]."""
        self._axes = Trajectory(
            [_through(times, [x for _, x, _ in frames]), _through(times, [side * y for *_, y in frames])]
        )

    @classmethod
    def deliver(cls, agv: int) -> AgvPath:
        """The way of AGV 1 or 2 out of the cell."""
        return cls(DELIVER, agv)

    @classmethod
    def return_(cls, agv: int) -> AgvPath:
        """The way of AGV 1 or 2 back to its station."""
        return cls(RETURN, agv)

    def position_at(self, time: int) -> tuple[float, float]:
        """Where it is `time` [ns] after it set out [m]."""
        x, y = self._axes.positions(time)
        return x, y

    def velocity_at(self, time: int) -> tuple[float, float]:
        """Its velocity `time` [ns] after it set out [m/s]."""
        x, y = self._axes.velocities(time)
        return x, y

    def acceleration_at(self, time: int) -> tuple[float, float]:
        """Its acceleration `time` [ns] after it set out [m/s^2]; it jumps at key frames."""
        x, y = self._axes.accelerations(time)
        return x, y

    def peak_acceleration(self) -> float:
        """The largest acceleration on the way [m/s^2].

        On a cubic the acceleration is linear in time, so its size is largest at one of the segment's ends.
        """
        return max(
            hypot(*(_accelerations(segment)[end] for segment in segments))
            for segments in zip(*self._axes.joints, strict=True)
            for end in (0, 1)
        )


def _through(times: list[int], values: list[float]) -> list[Segment]:
    """Cubics through one coordinate's values, at rest at both ends."""
    inner = [
        (after - before) / ((late - early) / NANOSECONDS)
        for before, after, early, late in zip(values, values[2:], times, times[2:], strict=False)
    ]
    knots = [Knot(value, velocity) for value, velocity in zip(values, [0.0, *inner, 0.0], strict=True)]
    return [join(s, a, e, b) for (s, e), (a, b) in zip(pairwise(times), pairwise(knots), strict=True)]


def _accelerations(segment: Segment) -> tuple[float, float]:
    """Acceleration at start and end of a cubic."""
    _, _, square, cube, _, _ = segment.coefficients
    return 2.0 * square, 2.0 * square + 6.0 * cube * (segment.end - segment.start) / NANOSECONDS
