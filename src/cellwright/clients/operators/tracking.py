"""How well a joint followed its target: errors, delay, and what a step shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

BAND = 0.05
"""A joint has settled when it stays within this part of the step."""
STILL = 0.02
"""A joint that moves less than this part of what it was told did not follow."""
LONGEST_DELAY = 0.5
"""Delays are looked for up to this [s], and up to half a period."""

_GRID = 0.001  # [s]
_LOW, _HIGH = 0.1, 0.9  # rise time is from here to there


@dataclass(frozen=True)
class Trace:
    """What a joint was told and what it did, against time [s] from the beginning of the signal.

    Attributes:
        joint: its name.
        told_at, told: targets [rad; m], each in force until the next.
        seen_at, seen: measured positions [rad; m].
    """

    joint: str
    told_at: Array
    told: Array
    seen_at: Array
    seen: Array

    @property
    def target(self) -> Array:
        """The target in force at each measured position [rad; m]."""
        found: Array = self.told[np.clip(np.searchsorted(self.told_at, self.seen_at, side="right") - 1, 0, None)]
        return found


@dataclass(frozen=True)
class StepResponse:
    """What the worst of a signal's steps shows.

    Attributes:
        overshoot: past the target, as a part of the step.
        rise: from 10 to 90 % of the step [s]; None if it did not get there.
        settling: until it stays within 5 % of the step [s]; None if it does not.
        rest: error [rad; m] just before the next step.
    """

    overshoot: float
    rise: float | None
    settling: float | None
    rest: float


@dataclass(frozen=True)
class Tracking:
    """How a joint followed.

    Attributes:
        joint: its name.
        rms: root of the mean square of target minus position [rad; m].
        worst: greatest error [rad; m].
        delay: by which the position comes after the target, by their correlation [s]; None if it did not follow.
        rate: measured positions a second [Hz].
        step: what its steps show; None where there are none.
    """

    joint: str
    rms: float
    worst: float
    delay: float | None
    rate: float
    step: StepResponse | None

    @property
    def judged(self) -> float:
        """The error [rad; m] that a limit is held against: the worst, or of steps what is left when they are over."""
        return self.worst if self.step is None else self.step.rest


def tracking(trace: Trace, *, period: float, edges: Sequence[float] = ()) -> Tracking:
    """How a joint followed its target.

    Args:
        trace: what it was told and did; two measured positions at least.
        period: of the signal [s].
        edges: when its steps are [s].
    """
    error = trace.target - trace.seen
    span = float(trace.seen_at[-1] - trace.seen_at[0])
    return Tracking(
        trace.joint,
        rms=float(np.sqrt(np.mean(error**2))),
        worst=float(np.abs(error).max()),
        delay=delay(trace, min(LONGEST_DELAY, period / 2)),
        rate=(len(trace.seen) - 1) / span if span > 0.0 else 0.0,
        step=step_response(trace, edges) if len(edges) else None,
    )


def delay(trace: Trace, longest: float) -> float | None:
    """By how much [s] the position comes after the target; None if it did not follow, or by more than `longest` [s]."""
    if np.ptp(trace.seen) < STILL * np.ptp(trace.told):
        return None
    begin = max(trace.told_at[0], trace.seen_at[0])
    grid = np.arange(begin, min(trace.told_at[-1], trace.seen_at[-1]), _GRID)
    lags = min(int(longest / _GRID), len(grid) // 2)
    if lags < 2:
        return None
    told = trace.told[np.searchsorted(trace.told_at, grid, side="right") - 1]
    seen = np.interp(grid, trace.seen_at, trace.seen)
    likeness = np.array([_correlation(told[: len(told) - lag], seen[lag:]) for lag in range(lags + 1)])
    best = int(likeness.argmax())
    if likeness[best] <= 0.0 or best == lags:
        return None
    return (best + _peak(likeness, best)) * _GRID


def step_response(trace: Trace, edges: Sequence[float]) -> StepResponse | None:
    """What the worst of the steps at times `edges` [s] shows; None if nothing was measured of them."""
    ends = [*edges[1:], float(trace.seen_at[-1])]
    found = [each for each in map(lambda begin, end: _one_step(trace, begin, end), edges, ends) if each is not None]
    if not found:
        return None
    rises, settlings = [each.rise for each in found], [each.settling for each in found]
    return StepResponse(
        max(each.overshoot for each in found), _slowest(rises), _slowest(settlings), max(each.rest for each in found)
    )


def _one_step(trace: Trace, begin: float, end: float) -> StepResponse | None:
    chosen = (trace.seen_at >= begin) & (trace.seen_at < end)
    before = trace.told[max(0, int(np.searchsorted(trace.told_at, begin)) - 1)]
    if np.count_nonzero(chosen) < 2:
        return None
    after = trace.target[chosen][-1]
    height = after - before
    if height == 0.0:
        return None
    at, way = trace.seen_at[chosen] - begin, (trace.seen[chosen] - before) / height
    low, high = _first(at, way, _LOW), _first(at, way, _HIGH)
    outside = np.flatnonzero(np.abs(way - 1.0) > BAND)
    settling: float | None = 0.0
    if len(outside):
        settling = float(at[outside[-1] + 1]) if outside[-1] + 1 < len(at) else None
    return StepResponse(
        overshoot=max(0.0, float(way.max()) - 1.0),
        rise=None if low is None or high is None else high - low,
        settling=settling,
        rest=abs(float(trace.seen[chosen][-1] - after)),
    )


def _first(at: Array, way: Array, level: float) -> float | None:
    """When a level is first reached, between two samples in proportion."""
    reached = np.flatnonzero(way >= level)
    if not len(reached):
        return None
    number = int(reached[0])
    if number == 0:
        return float(at[0])
    return float(np.interp(level, way[number - 1 : number + 1], at[number - 1 : number + 1]))


def _slowest(times: Sequence[float | None]) -> float | None:
    return None if None in times else max(time for time in times if time is not None)


def _correlation(one: Array, other: Array) -> float:
    one, other = one - one.mean(), other - other.mean()
    size = float(np.sqrt((one @ one) * (other @ other)))
    return float(one @ other) / size if size > 0.0 else 0.0


def _peak(values: Array, best: int) -> float:
    """Where the top of a parabola through three values lies, from the middle one."""
    if not 0 < best < len(values) - 1:
        return 0.0
    left, middle, right = values[best - 1 : best + 2]
    bend = left - 2.0 * middle + right
    return float(0.5 * (left - right) / bend) if bend < 0.0 else 0.0
