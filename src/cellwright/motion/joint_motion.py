"""Joint motion for the arm's controller: knots with velocities, cubics between them, splines through points."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple, TypedDict

from cellwright.config.arm import ARM_JOINTS
from cellwright.motion.joints import STILL, Joints, MotionLimits
from cellwright.util.errors import UsageError

_JOINED = 1e-6


def knot_velocities(
    times: Sequence[float], positions: Sequence[Joints], first: Joints | None = None, last: Joints | None = None
) -> tuple[Joints, ...]:
    """Return the knot velocities [rad/s; m/s] for which the cubics between the knots have continuous acceleration.

    The times of the knots rise, and are at least two. `first` and `last` are the velocities at the first and the last
    knot. Without them the acceleration there is zero.
    """
    ends = zip(first or (None,) * 7, last or (None,) * 7, strict=True)
    columns = [_column(times, values, *end) for values, end in zip(zip(*positions, strict=True), ends, strict=True)]
    return tuple(Joints(*row) for row in zip(*columns, strict=True))


def _column(times: Sequence[float], values: Sequence[float], first: float | None, last: float | None) -> list[float]:
    """Return the velocities of one joint by solving a tridiagonal system, forward and backward (Thomas)."""
    steps = [b - a for a, b in pairwise(times)]
    slopes = [(b - a) / step for a, b, step in zip(values, values[1:], steps, strict=False)]
    # A row is the equation: below * v[i-1] + middle * v[i] + above * v[i+1] = right.
    rows = [(0.0, 2.0, 1.0, 3.0 * slopes[0]) if first is None else (0.0, 1.0, 0.0, first)]
    for h0, h1, d0, d1 in zip(steps, steps[1:], slopes, slopes[1:], strict=False):
        # Equal accelerations of the two cubics at a knot, by their velocities v and slopes d over the steps h:
        # (2 v[i-1] + 4 v[i] - 6 d0) / h0 = (6 d1 - 4 v[i] - 2 v[i+1]) / h1, times h0 h1 / 2.
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


class MotionPoint(NamedTuple):
    """Positions and velocities of the joints at a time [s] after the start [m, rad; m/s, rad/s]."""

    time: float
    positions: Joints
    velocities: Joints


class ArmCommand(TypedDict):
    """Arguments of `Client.send_arm`."""

    waypoints: list[list[float]]
    times: list[float]
    velocities: list[list[float]]
    joints: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class JointMotion:
    """Knots of a motion; between them each joint follows the cubic through both, as in the arm's controller.

    Attributes:
        times: times of the knots [s], rising from 0.
        positions: positions at the knots [m for the rail; rad].
        velocities: velocities at the knots [m/s; rad/s].

    Raises:
        UsageError: times that do not rise from 0, or lists of different lengths.
    """

    times: tuple[float, ...]
    positions: tuple[Joints, ...]
    velocities: tuple[Joints, ...]

    def __post_init__(self) -> None:
        if not len(self.times) == len(self.positions) == len(self.velocities) > 0:
            lengths = f"{len(self.times)}, {len(self.positions)} and {len(self.velocities)}"
            raise UsageError(f"times, positions and velocities must have the same length, at least 1 (got {lengths})")
        if self.times[0] != 0.0 or any(not a < b for a, b in pairwise(self.times)):
            raise UsageError("times must rise from 0")

    @classmethod
    def hold(cls, joints: Joints, duration: float) -> JointMotion:
        """Return a motion that stands still for a time [s]; a single knot for zero time."""
        if not duration > 0.0:
            return cls((0.0,), (joints,), (STILL,))
        return cls((0.0, duration), (joints, joints), (STILL, STILL))

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return self.times[-1]

    @property
    def start(self) -> Joints:
        """Positions at the start."""
        return self.positions[0]

    @property
    def end(self) -> Joints:
        """Positions at the end."""
        return self.positions[-1]

    def at(self, time: float) -> MotionPoint:
        """Return the joints at a time [s]; before the start and after the end they stand still there."""
        if time < 0.0 or time > self.duration:
            return MotionPoint(time, self.start if time < 0.0 else self.end, STILL)
        index = bisect_right(self.times, time) - 1
        if self.times[index] == time:
            return MotionPoint(time, self.positions[index], self.velocities[index])
        step = self.times[index + 1] - self.times[index]
        u = (time - self.times[index]) / step
        positions, velocities = [], []
        for p0, p1, v0, v1 in zip(*self._ends(index), strict=True):
            a, b, distance = v0 * step, v1 * step, p1 - p0
            # Hermite's cubic over u from 0 to 1, with the given ends and end velocities.
            square, cube = 3.0 * distance - 2.0 * a - b, a + b - 2.0 * distance
            positions.append(p0 + u * (a + u * (square + u * cube)))
            velocities.append((a + u * (2.0 * square + u * 3.0 * cube)) / step)
        return MotionPoint(time, Joints(*positions), Joints(*velocities))

    def points(self, dt: float) -> tuple[MotionPoint, ...]:
        """Return the motion sampled every `dt` [s] from 0 on, and at its end.

        Raises:
            UsageError: `dt` is not above 0.
        """
        if not dt > 0.0:
            raise UsageError(f"dt must be positive (got {dt})")
        count = math.ceil(self.duration / dt - 1e-9)
        return tuple(self.at(min(index * dt, self.duration)) for index in range(count + 1))

    def then(self, following: JointMotion) -> JointMotion:
        """Return this motion followed by another without a pause.

        Raises:
            UsageError: the other begins at another position or velocity than this one ends with.
        """
        gaps = zip((*self.end, *self.velocities[-1]), (*following.start, *following.velocities[0]), strict=True)
        if any(abs(a - b) > _JOINED for a, b in gaps):
            raise UsageError("the next motion must begin at the position and velocity at which this one ends")
        return JointMotion(
            self.times + tuple(self.duration + time for time in following.times[1:]),
            self.positions + following.positions[1:],
            self.velocities + following.velocities[1:],
        )

    def strain(self, limits: MotionLimits) -> float:
        """Return the largest share of the velocity and acceleration limits that the motion uses; over 1 is too fast."""
        strain = 0.0
        for index, step in enumerate(b - a for a, b in pairwise(self.times)):
            rows = zip(*self._ends(index), limits.velocity, limits.acceleration, strict=True)
            for p0, p1, v0, v1, speed, push in rows:
                # The acceleration of a cubic is linear, so it is largest at an end. Of the velocity, a parabola, both
                # ends and the middle are taken.
                mean = (p1 - p0) / step
                middle = 1.5 * mean - 0.25 * (v0 + v1)
                first, last = (6.0 * mean - 4.0 * v0 - 2.0 * v1) / step, (2.0 * v0 + 4.0 * v1 - 6.0 * mean) / step
                strain = max(strain, abs(v0) / speed, abs(v1) / speed, abs(middle) / speed)
                strain = max(strain, abs(first) / push, abs(last) / push)
        return strain

    def _ends(self, index: int) -> tuple[Joints, Joints, Joints, Joints]:
        """Return positions and velocities at both ends of a cubic."""
        return *self.positions[index : index + 2], *self.velocities[index : index + 2]  # type: ignore[return-value]

    def command(self, joints: Sequence[str] = ARM_JOINTS) -> ArmCommand:
        """Return the motion as arguments: `client.send_arm(**motion.command())`.

        They leave out the first knot: the controller begins at its own target for that time.
        """
        names = tuple(joints)
        kept = range(min(1, len(self.times) - 1), len(self.times))
        return {
            "waypoints": [self.positions[index].ordered(names) for index in kept],
            "times": [self.times[index] for index in kept],
            "velocities": [self.velocities[index].ordered(names) for index in kept],
            "joints": names,
        }
