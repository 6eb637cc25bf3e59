"""Joint trajectories: polynomial segments in time, and the desired joint states at a given time.

A segment between two knots is a straight line, a cubic or a quintic. A cubic needs velocities at both knots, a quintic
accelerations as well. Time is in whole nanoseconds; inside a segment it is seconds since the segment's start.
Positions are in rad for revolute and in m for prismatic joints.

Everything is computed in double precision with a fixed order of operations, so a trajectory is the same on every host.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cellwright.engine.clock import NANOSECONDS, NEVER

Coefficients: TypeAlias = tuple[float, float, float, float, float, float]

ALWAYS = -NEVER
"""Time [ns] before every run."""

_FEW = 8
"""Number of times below which evaluating them one by one is faster than all at once."""


@dataclass(frozen=True, slots=True)
class TrajectoryPoint:
    """Point of a commanded trajectory as received, unchecked.

    Positions [rad or m] are one per name of the trajectory; velocities and accelerations have the same length, or are
    empty.
    """

    positions: Sequence[float]
    velocities: Sequence[float] = ()
    accelerations: Sequence[float] = ()
    time_from_start_ns: int = 0


@dataclass(frozen=True, slots=True)
class JointTrajectory:
    """Commanded trajectory as received; `start_ns` None starts it at once."""

    joint_names: Sequence[str]
    points: Sequence[TrajectoryPoint]
    start_ns: int | None = None


class Knot(NamedTuple):
    """Desired state of one joint at an end of a segment; None where unspecified."""

    position: float
    velocity: float | None = None
    acceleration: float | None = None


class Segment(NamedTuple):
    """Motion of one joint from `start` to `end` [ns]: a polynomial of the seconds since `start`, lowest power first.

    `final` is the position at the end [rad or m], exactly as requested. If no other segment follows, the joint rests
    there.
    """

    start: int
    end: int
    coefficients: Coefficients
    final: float


class JointsState(NamedTuple):
    """Desired state of all joints at a time: positions, velocities and accelerations in SI units, one per joint."""

    positions: list[float]
    velocities: list[float]
    accelerations: list[float]


def rest_segment(time: int, position: float) -> Segment:
    """Return the segment of no length after which a joint rests at `position` from `time` [ns] on."""
    return Segment(time, time, (position, 0.0, 0.0, 0.0, 0.0, 0.0), position)


def join_segment(start: int, a: Knot, end: int, b: Knot) -> Segment:
    """Return the segment from knot `a` at time `start` [ns] to knot `b` at time `end` [ns].

    It is a straight line unless both knots have velocities, then a cubic unless both have accelerations too, then a
    quintic. The coefficients solve the Hermite conditions at both ends. With no time between the knots it is a jump to
    `b`.
    """
    t = (end - start) / NANOSECONDS
    if t <= 0.0:
        return rest_segment(start, b.position)
    p0, v0, a0 = a
    p1, v1, a1 = b
    d = p1 - p0
    if v0 is None or v1 is None:
        return Segment(start, end, (p0, d / t, 0.0, 0.0, 0.0, 0.0), p1)
    if a0 is None or a1 is None:
        square = (3.0 * d - (2.0 * v0 + v1) * t) / t**2
        cube = ((v0 + v1) * t - 2.0 * d) / t**3
        return Segment(start, end, (p0, v0, square, cube, 0.0, 0.0), p1)
    # Position, velocity and acceleration at both ends are six conditions for six coefficients. Three follow at once
    # from the start, and these three from a linear system that is solved by hand.
    third = (20.0 * d - (12.0 * v0 + 8.0 * v1) * t - (3.0 * a0 - a1) * t**2) / (2.0 * t**3)
    fourth = ((16.0 * v0 + 14.0 * v1) * t - 30.0 * d + (3.0 * a0 - 2.0 * a1) * t**2) / (2.0 * t**4)
    fifth = (12.0 * d - 6.0 * (v0 + v1) * t + (a1 - a0) * t**2) / (2.0 * t**5)
    return Segment(start, end, (p0, v0, 0.5 * a0, third, fourth, fifth), p1)


def stop_segment(start: int, position: float, velocity: float, duration: int) -> Segment:
    """Return the segment that brings a joint to rest in `duration` [ns], without reversing.

    It is the first half of a quintic of twice the duration, with no acceleration at its ends. That quintic would
    bring the joint back to `position` with `-velocity`. The joint comes to rest 5/8 velocity x duration further on, and
    decelerates by at most 3/2 velocity / duration.
    """
    if duration <= 0 or velocity == 0.0:
        return rest_segment(start, position)
    t = duration / NANOSECONDS
    # The quintic through (position, velocity) and (position, -velocity) in 2 t is symmetric about t, where it rests:
    # velocity (x - x^3 / (2 t^2) + x^4 / (8 t^3)), without a fifth power. At t that is 5/8 velocity t.
    coefficients = (position, velocity, 0.0, -velocity / (2.0 * t**2), velocity / (8.0 * t**3), 0.0)
    return Segment(start, start + duration, coefficients, position + 0.625 * velocity * t)


class Trajectory:
    """Desired motion of several joints, from the first of their segments on.

    Each joint has its own segments, in order of their start times. A segment is in force until the next one starts;
    from its end until then the joint rests at its final position.
    """

    def __init__(self, joints: Iterable[Iterable[Segment]]) -> None:
        self.joints = tuple(tuple(segments) for segments in joints)
        self.start = max(segments[0].start for segments in self.joints)
        """Start of the known motion [ns]."""
        self.end = max(segments[-1].end for segments in self.joints)
        """Time [ns] from which on the joints rest."""
        self._starts = [[segment.start for segment in segments] for segments in self.joints]
        # The polynomials in force from `_since` until `_until`; a cache of what the trajectory itself says.
        self._since, self._until = 0, 0
        self._rows: list[tuple[int, float, float, float, float, float, float]] = []
        self._degree = 0

    def positions(self, time: int) -> list[float]:
        """Return the position of each joint [rad or m] at `time` [ns]."""
        if not self._since <= time < self._until:
            self._enter(time)
        if self._degree == 0:
            return [a for _, a, _, _, _, _, _ in self._rows]
        if self._degree == 1:
            return [(time - s) / 1e9 * b + a for s, a, b, _, _, _, _ in self._rows]
        if self._degree == 3:
            return [(((t := (time - s) / 1e9) * d + c) * t + b) * t + a for s, a, b, c, d, _, _ in self._rows]
        return [
            (((((t := (time - s) / 1e9) * f + e) * t + d) * t + c) * t + b) * t + a
            for s, a, b, c, d, e, f in self._rows
        ]

    def velocities(self, time: int) -> list[float]:
        """Return the velocity of each joint [rad/s or m/s] at `time` [ns]; zero where it rests."""
        if not self._since <= time < self._until:
            self._enter(time)
        if self._degree <= 1:
            return [b for _, _, b, _, _, _, _ in self._rows]
        if self._degree == 3:
            return [((t := (time - s) / 1e9) * 3.0 * d + 2.0 * c) * t + b for s, _, b, c, d, _, _ in self._rows]
        return [
            ((((t := (time - s) / 1e9) * 5.0 * f + 4.0 * e) * t + 3.0 * d) * t + 2.0 * c) * t + b
            for s, _, b, c, d, e, f in self._rows
        ]

    def accelerations(self, time: int) -> list[float]:
        """Return the acceleration of each joint [rad/s^2 or m/s^2] at `time` [ns]; zero where it rests."""
        if not self._since <= time < self._until:
            self._enter(time)
        return [
            (((t := (time - s) / 1e9) * 20.0 * f + 12.0 * e) * t + 6.0 * d) * t + 2.0 * c
            for s, _, _, c, d, e, f in self._rows
        ]

    def state(self, time: int) -> JointsState:
        """Return positions, velocities and accelerations at `time` [ns]."""
        return JointsState(self.positions(time), self.velocities(time), self.accelerations(time))

    def sample(self, times: Sequence[int]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return positions and velocities at ascending `times` [ns], each of shape (times, joints).

        They are equal to those of `positions` and `velocities` at each time, to the last bit.
        """
        positions, velocities = np.empty((2, len(times), len(self.joints)))
        begin = 0
        while begin < len(times):
            if not self._since <= times[begin] < self._until:
                self._enter(times[begin])
            end = bisect_left(times, self._until, begin)
            if end - begin < _FEW:
                positions[begin:end] = [self.positions(time) for time in times[begin:end]]
                velocities[begin:end] = [self.velocities(time) for time in times[begin:end]]
            else:
                self._evaluate(times[begin:end], positions[begin:end], velocities[begin:end])
            begin = end
        return positions, velocities

    def _evaluate(self, times: Sequence[int], positions: NDArray[np.float64], velocities: NDArray[np.float64]) -> None:
        """Write the values of the polynomials in force, with the operations of `positions` and `velocities`."""
        starts = np.array([row[0] for row in self._rows], dtype=np.int64)
        a, b, c, d, e, f = np.array([row[1:] for row in self._rows]).T
        if self._degree <= 1:
            velocities[:] = b
        if self._degree == 0:
            positions[:] = a
            return
        t = (np.array(times, dtype=np.int64)[:, None] - starts) / 1e9
        with np.errstate(all="ignore"):  # plain floats overflow silently, too
            if self._degree == 1:
                positions[:] = t * b + a
            elif self._degree == 3:
                positions[:] = ((t * d + c) * t + b) * t + a
                velocities[:] = (t * 3.0 * d + 2.0 * c) * t + b
            else:
                positions[:] = ((((t * f + e) * t + d) * t + c) * t + b) * t + a
                velocities[:] = (((t * 5.0 * f + 4.0 * e) * t + 3.0 * d) * t + 2.0 * c) * t + b

    def between(self, joint: int, now: int, until: int) -> tuple[Segment, ...]:
        """Return the segments of one joint that are in force at some time from `now` until `until` [ns]."""
        starts = self._starts[joint]
        first = max(0, bisect_right(starts, now) - 1)
        return self.joints[joint][first : max(first + 1, bisect_right(starts, until))]

    def get_state(self) -> list[list[list[Any]]]:
        """Return the segments of each joint as JSON values."""
        return [[[s.start, s.end, list(s.coefficients), s.final] for s in segments] for segments in self.joints]

    @classmethod
    def from_state(cls, state: Sequence[Sequence[Sequence[Any]]]) -> Trajectory:
        """Restore the trajectory from what `get_state` returned."""
        return cls([Segment(s, e, (c[0], c[1], c[2], c[3], c[4], c[5]), f) for s, e, c, f in joint] for joint in state)

    def _enter(self, time: int) -> None:
        """Look up the polynomials in force at `time`, and the interval in which they are."""
        since, until, degree = ALWAYS, NEVER, 0
        rows = []
        for segments, starts in zip(self.joints, self._starts, strict=True):
            index = bisect_right(starts, time) - 1
            segment = segments[max(index, 0)]
            following = starts[index + 1] if index + 1 < len(starts) else NEVER
            if index >= 0 and time < segment.end:
                since, until = max(since, segment.start), min(until, segment.end, following)
                c = segment.coefficients
                degree = max(degree, 5 if c[4] or c[5] else 3 if c[2] or c[3] else 1)
                rows.append((segment.start, *c))
            else:  # at rest: before the first segment, or after the end of one
                since, until = max(since, segment.end if index >= 0 else ALWAYS), min(until, following)
                position = segment.final if index >= 0 else segment.coefficients[0]
                rows.append((time, position, 0.0, 0.0, 0.0, 0.0, 0.0))
        self._rows, self._since, self._until, self._degree = rows, since, until, degree
