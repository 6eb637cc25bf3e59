"""Test signals for a joint: waves, their run, and the joint's tracking."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cellwright.clients.operators.robot import JOINT_STATES, JointLimits, MoveJoints, OperatedRobot, by_name
from cellwright.middleware.messages.conversions import nanoseconds
from cellwright.util.errors import CellwrightError, RunEndedError, UsageError

MAX_DURATION = 3600.0
"""[s]"""
MAX_FREQUENCY = 50.0
"""Half the rate of commands [Hz]: a faster wave cannot be sent."""

SETTLING_BAND = 0.05
"""Share of the step within which a joint has settled."""
MIN_MOTION_SHARE = 0.02
"""Share of its target's motion below which a joint did not follow."""
MAX_DELAY = 0.5
"""Longest delay [s] that is searched for; half a period if that is shorter."""
_GRID = 0.001  # [s]
_LOW, _HIGH = 0.1, 0.9  # rise time is from here to there
RATE = 100.0
"""Commands a second, as of the original's controller [Hz]."""
TAIL = 0.5
"""Time [s] that the joint is watched after the signal; its target is the start meanwhile."""
_MIN_SAMPLES = 10  # joint states that a report needs
_LIMITED_SHARE = 0.02  # of the amplitude: a larger difference of target and applied is no chance of sampling


class WaveShape(StrEnum):
    """The shape of a wave."""

    SINE = "sine"
    """To both sides of the start."""
    STEP = "step"
    """Half a period at the start, half a period away from it."""
    RAMP = "ramp"
    """Away from the start and back, at constant speed."""


@dataclass(frozen=True, slots=True)
class Wave:
    """A test signal of whole periods, which ends where it began."""

    shape: WaveShape
    amplitude: float
    """Largest offset [rad; m]; the sign is the side of the first motion."""
    frequency: float
    """[Hz]"""
    periods: int

    @classmethod
    def lasting(cls, shape: WaveShape, amplitude: float, frequency: float, duration: float) -> Wave:
        """Return a wave of about a duration [s], at least one period.

        Raises:
            UsageError: a number is out of its range.
        """
        if not math.isfinite(amplitude) or amplitude == 0.0:
            raise UsageError(f"an amplitude must not be 0 (got {amplitude:g})")
        if not 0.0 < frequency <= MAX_FREQUENCY:
            raise UsageError(f"a frequency must be above 0 and at most {MAX_FREQUENCY:g} Hz (got {frequency:g})")
        if not 0.0 < duration <= MAX_DURATION:
            raise UsageError(f"a duration must be above 0 and at most {MAX_DURATION:g} s (got {duration:g})")
        periods = max(1, round(duration * frequency))
        if periods / frequency > MAX_DURATION:
            raise UsageError(f"a period of {1 / frequency:g} s is longer than {MAX_DURATION:g} s")
        return cls(shape, amplitude, frequency, periods)

    @property
    def duration(self) -> float:
        """Duration [s]."""
        return self.periods / self.frequency

    @property
    def offset_range(self) -> tuple[float, float]:
        """Lowest and highest offset [rad; m]."""
        far = abs(self.amplitude)
        if self.shape is WaveShape.SINE:
            return -far, far
        return (0.0, far) if self.amplitude > 0 else (-far, 0.0)

    @property
    def speed(self) -> float:
        """Largest speed [rad/s; m/s]; infinite for a step."""
        match self.shape:
            case WaveShape.SINE:
                return abs(self.amplitude) * 2 * math.pi * self.frequency
            case WaveShape.RAMP:
                return abs(self.amplitude) * 2 * self.frequency
            case WaveShape.STEP:
                return math.inf

    def offset(self, time: float) -> float:
        """Return the offset [rad; m] at a time [s] from its beginning; 0 before and after."""
        if not 0.0 <= time < self.duration:
            return 0.0
        phase = time * self.frequency % 1.0
        match self.shape:
            case WaveShape.SINE:
                return self.amplitude * math.sin(2 * math.pi * phase)
            case WaveShape.RAMP:
                return self.amplitude * (1.0 - abs(2.0 * phase - 1.0))
            case WaveShape.STEP:
                return self.amplitude if phase >= 0.5 else 0.0


Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trace:
    """Targets and measured positions of a joint [rad; m], against time [s] from the beginning of the signal.

    Each target is in force until the next.
    """

    joint: str
    target_times: Array
    targets: Array
    measured_times: Array
    measured: Array

    @property
    def target_in_force(self) -> Array:
        """The target in force at each measured position [rad; m]."""
        found: Array = self.targets[
            np.clip(np.searchsorted(self.target_times, self.measured_times, side="right") - 1, 0, None)
        ]
        return found


@dataclass(frozen=True)
class JointStepResponse:
    """Step response of a joint: the worst of a signal's steps."""

    overshoot: float
    """Overshoot past the target, as a share of the step."""
    rise: float | None
    """Rise time from 10 to 90 % of the step [s]; None if it did not get there."""
    settling: float | None
    """Time until it stays within 5 % of the step [s]; None if it does not."""
    rest: float
    """Error [rad; m] just before the next step."""


@dataclass(frozen=True)
class Tracking:
    """Tracking of a target by a joint."""

    joint: str
    rms: float
    """Root of the mean square of target minus position [rad; m]."""
    worst: float
    """Largest error [rad; m]."""
    delay: float | None
    """Delay of the position after the target, by their correlation [s]; None if it did not follow."""
    rate: float
    """Measured positions per second [Hz]."""
    step: JointStepResponse | None
    """Response to its steps; None where there are none."""

    @property
    def judged(self) -> float:
        """The error [rad; m] that a limit applies to: the largest, or for steps the one left at their ends."""
        return self.worst if self.step is None else self.step.rest


def tracking(trace: Trace, *, period: float, edges: Sequence[float] = ()) -> Tracking:
    """Return the tracking of a trace of at least two measured positions; `edges` are the times of its steps [s]."""
    error = trace.target_in_force - trace.measured
    span = float(trace.measured_times[-1] - trace.measured_times[0])
    return Tracking(
        trace.joint,
        rms=float(np.sqrt(np.mean(error**2))),
        worst=float(np.abs(error).max()),
        delay=delay(trace, min(MAX_DELAY, period / 2)),
        rate=(len(trace.measured) - 1) / span if span > 0.0 else 0.0,
        step=step_response(trace, edges) if len(edges) else None,
    )


def delay(trace: Trace, max_delay: float) -> float | None:
    """Return the delay [s] of the position after the target; None if it did not follow, or above `max_delay` [s]."""
    # a joint that stands still is like any signal: its correlation would be noise
    if np.ptp(trace.measured) < MIN_MOTION_SHARE * np.ptp(trace.targets):
        return None
    begin = max(trace.target_times[0], trace.measured_times[0])
    # targets and positions come at times of their own, so both are taken at the times of one grid
    grid = np.arange(begin, min(trace.target_times[-1], trace.measured_times[-1]), _GRID)
    lags = min(int(max_delay / _GRID), len(grid) // 2)
    if lags < 2:
        return None
    target = trace.targets[np.searchsorted(trace.target_times, grid, side="right") - 1]
    measured = np.interp(grid, trace.measured_times, trace.measured)
    likeness = np.array([_correlation(target[: len(target) - lag], measured[lag:]) for lag in range(lags + 1)])
    best = int(likeness.argmax())
    # at the last lag the likeness may still rise: the true delay is longer than what was searched
    if likeness[best] <= 0.0 or best == lags:
        return None
    return (best + _peak(likeness, best)) * _GRID


def step_response(trace: Trace, edges: Sequence[float]) -> JointStepResponse | None:
    """Return the worst response to the steps at times `edges` [s]; None if none of them was measured."""
    ends = [*edges[1:], float(trace.measured_times[-1])]
    found = [each for each in map(lambda begin, end: _one_step(trace, begin, end), edges, ends) if each is not None]
    if not found:
        return None
    rises, settlings = [each.rise for each in found], [each.settling for each in found]
    return JointStepResponse(
        max(each.overshoot for each in found), _slowest(rises), _slowest(settlings), max(each.rest for each in found)
    )


def _one_step(trace: Trace, begin: float, end: float) -> JointStepResponse | None:
    chosen = (trace.measured_times >= begin) & (trace.measured_times < end)
    before = trace.targets[max(0, int(np.searchsorted(trace.target_times, begin)) - 1)]
    if np.count_nonzero(chosen) < 2:
        return None
    after = trace.target_in_force[chosen][-1]
    height = after - before
    if height == 0.0:
        return None
    at, response = trace.measured_times[chosen] - begin, (trace.measured[chosen] - before) / height
    low, high = _first_reached(at, response, _LOW), _first_reached(at, response, _HIGH)
    # it has settled behind the last sample outside the band, even if it was inside before
    outside = np.flatnonzero(np.abs(response - 1.0) > SETTLING_BAND)
    settling: float | None = 0.0
    if len(outside):
        settling = float(at[outside[-1] + 1]) if outside[-1] + 1 < len(at) else None
    return JointStepResponse(
        overshoot=max(0.0, float(response.max()) - 1.0),
        rise=None if low is None or high is None else high - low,
        settling=settling,
        rest=abs(float(trace.measured[chosen][-1] - after)),
    )


def _first_reached(at: Array, response: Array, level: float) -> float | None:
    """Return the first time at a level, linear between two samples."""
    reached = np.flatnonzero(response >= level)
    if not len(reached):
        return None
    number = int(reached[0])
    if number == 0:
        return float(at[0])
    return float(np.interp(level, response[number - 1 : number + 1], at[number - 1 : number + 1]))


def _slowest(times: Sequence[float | None]) -> float | None:
    return None if None in times else max(time for time in times if time is not None)


def _correlation(one: Array, other: Array) -> float:
    one, other = one - one.mean(), other - other.mean()
    size = float(np.sqrt((one @ one) * (other @ other)))
    return float(one @ other) / size if size > 0.0 else 0.0


def _peak(values: Array, best: int) -> float:
    """Return the peak of a parabola through three values, relative to the middle one."""
    if not 0 < best < len(values) - 1:
        return 0.0
    left, middle, right = values[best - 1 : best + 2]
    # the vertex of y = a x^2 + b x + c through x = -1, 0, 1, with 2a = bend and 2b = right - left, is at -b / 2a
    bend = left - 2.0 * middle + right
    return float(0.5 * (left - right) / bend) if bend < 0.0 else 0.0


@dataclass(frozen=True)
class Exercise:
    """Result of a signal that began at the joint's position `start` [rad; m]."""

    wave: Wave
    start: float
    trace: Trace
    tracking: Tracking
    note: str = ""
    """The node's changes to the targets, in a sentence; empty when it applied them."""


def check_signal(robot: OperatedRobot, joints: list[str], wave: Wave, limits: JointLimits) -> list[str]:
    """Refuse a signal that joints cannot be given at their positions; return warnings about joints too slow for it.

    Raises:
        UnknownNameError: the robot has no such joint.
        UsageError: a joint is a mimic joint, the signal would leave its limits, the node takes no commands, or it does
            not publish the joint's position.
    """
    robot.check_names(joints)
    for joint in joints:
        if joint in limits.leaders:
            raise UsageError(f"{joint} follows {limits.leaders[joint]} (mimic); test that one")
    other = "--wave step" if wave.shape is WaveShape.SINE else "one of the other sign"
    for joint in joints:
        start, (low, high) = robot.position(joint), wave.offset_range
        motion = f"a {wave.shape} of {wave.amplitude:g}"
        limits.check(joint, start + low, start + high, motion, f"give a smaller --amplitude, or {other}")
    robot.check_ready()
    speeds = {joint: limits.of_joint(joint).velocity for joint in joints}
    return [
        f"{joint}: the signal is too fast for the joint (needs {wave.speed:.3g} a second, limit {speed:.3g})"
        for joint, speed in speeds.items()
        if speed < wave.speed < math.inf  # a step is as fast as possible anyway
    ]


def exercise(
    robot: OperatedRobot, joint: str, wave: Wave, *, on_progress: Callable[[float], None] = lambda _part: None
) -> Exercise:
    """Give a joint a signal about its position, with `RATE` commands a second, and bring it back there.

    After each command `on_progress` takes the share of the signal that is over, 0 to 1.

    Raises:
        UsageError: too few joint states came for a report.
    """
    session = robot.session
    start, begun = robot.position(joint), session.time
    sent: list[tuple[float, float]] = []
    seen: list[tuple[float, float, float]] = []
    applied: list[float] = []

    def record_state(message: Any) -> None:
        position = by_name(message).get(joint)
        if position is not None:
            seen.append((session.time - begun, nanoseconds(message.header.stamp) / 1e9, position))

    leave = session.subscribe(JOINT_STATES, record_state)
    try:
        beat = session.rate(RATE)
        while (time := session.time - begun) < wave.duration + TAIL:
            target = start + wave.offset(time)
            robot.send(MoveJoints({joint: target}))
            sent.append((time, target))
            on_progress(min(1.0, time / wave.duration))
            beat.sleep()
            if joint in (now := robot.applied):
                applied.append(now[joint])
    finally:
        for part in (partial(robot.send, MoveJoints({joint: start})), leave):
            with suppress(CellwrightError, RunEndedError):  # the node may be gone
                part()
    if len(seen) < _MIN_SAMPLES:
        raise UsageError(f"{joint}: only {len(seen)} joint states came in {wave.duration + TAIL:g} s")
    trace = _trace(joint, sent, seen)
    edges = [n / 2 / wave.frequency for n in range(1, 2 * wave.periods + 1)] if wave.shape is WaveShape.STEP else ()
    figures = tracking(trace, period=1 / wave.frequency, edges=edges)
    return Exercise(wave, start, trace, figures, _limited_note(trace.targets, applied, wave))


def _trace(joint: str, sent: list[tuple[float, float]], seen: list[tuple[float, float, float]]) -> Trace:
    """Return the samples as arrays; joint states have the node's own stamps where it gives them."""
    receive_times, stamps, positions = np.array(seen).T
    measured_times: Array = receive_times
    # Stamps have less jitter than times of arrival; the median of the differences shifts the node's clock to ours.
    if np.all(np.diff(stamps) > 0.0):
        measured_times = stamps + np.median(receive_times - stamps)
    times, targets = np.array(sent).T
    return Trace(joint, times, targets, measured_times, positions)


def _limited_note(targets: Array, applied: list[float], wave: Wave) -> str:
    """Return a sentence on targets that the node did not apply unchanged."""
    if not applied:
        return ""
    slack = _LIMITED_SHARE * abs(wave.amplitude)
    low, high = float(targets.min()), float(targets.max())
    if min(applied) > low + slack or max(applied) < high - slack:
        return (
            f"sent {low:.4g} to {high:.4g}, the node applied {min(applied):.4g} to {max(applied):.4g}: "
            "it limits the targets"
        )
    return ""
