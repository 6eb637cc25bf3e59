"""Joint trajectories: polynomial segments in time, and the desired joint states at a given time.

A segment between two knots is a straight line, a cubic or a quintic. A cubic needs velocities at both knots, a quintic
accelerations as well. Time is in whole nanoseconds; inside a segment it is seconds since the segment's start.
Positions are in rad for revolute and in m for prismatic joints.

Everything is computed in double precision with a fixed order of operations, so a trajectory is the same on every host.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cellwright.engine.clock import NANOSECONDS, NEVER

Coefficients: TypeAlias = tuple[float, float, float, float, float, float]

ALWAYS = -NEVER
"""Time [ns] before every run."""


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


KnotValues: TypeAlias = tuple[float, float | None, float | None]
"""Values of a `Knot`: as a plain tuple they are made ten times as fast."""


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


def join_segment(start: int, a: KnotValues, end: int, b: KnotValues) -> Segment:
    """Return the segment from knot `a` at time `start` [ns] to knot `b` at time `end` [ns].

    It is a straight line unless both knots have velocities, then a cubic unless both have accelerations too, then a
    quintic. The coefficients solve the Hermite conditions at both ends. With no time between the knots it is a jump to
    `b`.
    """
    t = (end - start) / NANOSECONDS
    if t <= 0.0:
        return rest_segment(start, b[0])
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


def _at_rest(position: float) -> Coefficients:
    return position, 0.0, 0.0, 0.0, 0.0, 0.0


class Trajectory:
    """Desired motion of several joints, from the first of their segments on.

    Each joint has its own segments, in order of their start times. A segment is in force until the next one starts;
    from its end until then the joint rests at its final position.
    """

    def __init__(self, joints: Iterable[Iterable[Segment]]) -> None:
        self.joints = tuple(map(tuple, joints))
        self.start = max([segments[0].start for segments in self.joints])
        """Start of the known motion [ns]."""
        self.end = max([segments[-1].end for segments in self.joints])
        """Time [ns] from which on the joints rest."""
        self._starts = [[segment[0] for segment in segments] for segments in self.joints]
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

        They are equal to those of `positions` and `velocities` at each time: to a power that a polynomial lacks belongs
        a coefficient of 0, which changes no value.
        """
        table = self._table(times[0], times[-1])
        if table is None:
            states = [(self.positions(time), self.velocities(time)) for time in times]
            positions, velocities = zip(*states, strict=True)
            return np.array(positions), np.array(velocities)
        begins, rows = table
        coefficients = np.array(rows).transpose(2, 0, 1)
        starts, at = np.array(begins), np.array(times)
        row = starts.searchsorted(at, "right") - 1
        t = ((at - starts[row]) / 1e9)[:, None]
        highest = max([1, *np.flatnonzero(coefficients.any(axis=(1, 2))).tolist()])
        with np.errstate(all="ignore"):  # plain floats overflow silently, too
            if highest == 1:
                a, b = coefficients[:2, row]
                return t * b + a, b
            if highest <= 3:
                a, b, c, d = coefficients[:4, row]
                return ((t * d + c) * t + b) * t + a, (t * 3.0 * d + 2.0 * c) * t + b
            a, b, c, d, e, f = coefficients[:, row]
            return (
                ((((t * f + e) * t + d) * t + c) * t + b) * t + a,
                (((t * 5.0 * f + 4.0 * e) * t + 3.0 * d) * t + 2.0 * c) * t + b,
            )

    def _table(self, first: int, last: int) -> tuple[list[int], list[list[Coefficients]]] | None:
        """Return the polynomials in force from `first` to `last` [ns], if all joints change theirs together.

        Returns:
            Times from which on they are in force, and from which they count their seconds; the polynomials of the
            joints from each of these on. None if they do not change together, as after a command for some joints.
        """
        starts = self._starts[0]
        if any(each != starts for each in self._starts):
            return None
        low = max(0, bisect_right(starts, first) - 1)
        begins: list[int] = []
        rows: list[list[Coefficients]] = []
        if first < starts[0]:
            begins.append(first)
            rows.append([_at_rest(segments[0].coefficients[0]) for segments in self.joints])
        for index in range(low, bisect_right(starts, last)):
            segments = [each[index] for each in self.joints]
            start, end, *_ = segments[0]
            if any(each.end != end for each in segments):
                return None
            following = starts[index + 1] if index + 1 < len(starts) else NEVER
            if start < min(end, following):
                begins.append(start)
                rows.append([each.coefficients for each in segments])
            if end < following and end <= last:
                begins.append(end)
                rows.append([_at_rest(each.final) for each in segments])
        return begins, rows

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
        if time >= self.end:
            finals = [segments[-1][3] for segments in self.joints]
            self._rows = [(time, final, 0.0, 0.0, 0.0, 0.0, 0.0) for final in finals]
            self._since, self._until, self._degree = self.end, NEVER, 0
            return
        since, until, degree = ALWAYS, NEVER, 0
        rows = []
        for segments, starts in zip(self.joints, self._starts, strict=True):
            index = bisect_right(starts, time) - 1
            start, end, c, final = segments[index if index > 0 else 0]
            if index + 1 < len(starts) and starts[index + 1] < until:
                until = starts[index + 1]
            if index >= 0 and time < end:
                if start > since:
                    since = start
                if end < until:
                    until = end
                degree = max(degree, 5 if c[4] or c[5] else 3 if c[2] or c[3] else 1)
                rows.append((start, *c))
            else:  # at rest: before the first segment, or after the end of one
                if index >= 0 and end > since:
                    since = end
                rows.append((time, final if index >= 0 else c[0], 0.0, 0.0, 0.0, 0.0, 0.0))
        self._rows, self._since, self._until, self._degree = rows, since, until, degree
