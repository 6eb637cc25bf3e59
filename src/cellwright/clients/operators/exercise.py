"""Gives a joint a test signal by /io_teleop/joint_cmd, and keeps what it was told and what it did."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from cellwright.clients.operators.limits import JointLimits
from cellwright.clients.operators.robot import JOINT_STATES, OperatedRobot, by_name
from cellwright.clients.operators.tracking import Array, Trace, Tracking, tracking
from cellwright.clients.operators.waves import Shape, Wave
from cellwright.middleware.messages.build import nanoseconds
from cellwright.util.errors import CellwrightError, RunEndedError, UsageError

RATE = 100.0
"""Commands a second, as of the original's controller [Hz]."""
TAIL = 0.5
"""So long [s] the joint is watched when the signal is over; it is asked back to its start meanwhile."""

_FEWEST = 10  # joint states that a report can be made of
_HELD_BACK = 0.02  # of the amplitude: more than this between asked and applied is no chance of sampling


@dataclass(frozen=True)
class Exercise:
    """What came of a signal.

    Attributes:
        wave: the signal.
        start: where the joint stood, and the signal began [rad; m].
        trace: what it was told and did.
        tracking: how well it followed.
        note: what the node made of the targets, in a sentence; empty when it applied them.
    """

    wave: Wave
    start: float
    trace: Trace
    tracking: Tracking
    note: str = ""


def check(robot: OperatedRobot, joints: list[str], wave: Wave, limits: JointLimits) -> list[str]:
    """Refuse a signal that joints cannot be given from where they stand now.

    Returns:
        Sentences about joints that cannot follow it, for they are too slow.

    Raises:
        UnknownNameError: the robot has no such joint.
        UsageError: the signal would leave their limits, or the node takes no commands or does not say where one is.
    """
    robot.check_names(joints)
    for joint in joints:
        start, (low, high) = robot.position(joint), wave.reach
        limits.check(joint, start + low, start + high, f"a {wave.shape} of {wave.amplitude:g}")
    robot.check_ready()
    speeds = {joint: limits.of_joint(joint).velocity for joint in joints}
    return [
        f"{joint}: the signal goes at {wave.speed:.3g} a second, and the joint can do {speed:.3g}"
        for joint, speed in speeds.items()
        if speed < wave.speed < math.inf  # a step is as fast as it gets anyway
    ]


def exercise(
    robot: OperatedRobot,
    joint: str,
    wave: Wave,
    *,
    rate: float = RATE,
    on_beat: Callable[[float], None] = lambda _part: None,
) -> Exercise:
    """Give a joint a signal, and bring it back to where it stood.

    Args:
        robot: whose joint it is.
        joint: its name.
        wave: the signal, about where the joint stands now.
        rate: commands a second [Hz].
        on_beat: told after each command how much of the signal is over, 0 to 1.

    Raises:
        UsageError: too few joint states came to say anything.
    """
    session = robot.session
    start, begun = robot.position(joint), session.time
    told: list[tuple[float, float]] = []
    seen: list[tuple[float, float, float]] = []
    applied: list[float] = []

    def note(message: Any) -> None:
        position = by_name(message).get(joint)
        if position is not None:
            seen.append((session.time - begun, nanoseconds(message.header.stamp) / 1e9, position))

    leave = session.subscribe(JOINT_STATES, note)
    try:
        beat = session.rate(rate)
        while (time := session.time - begun) < wave.duration + TAIL:
            target = start + wave.offset(time)
            robot.send_joints({joint: target})
            told.append((time, target))
            on_beat(min(1.0, time / wave.duration))
            beat.sleep()
            if joint in (now := robot.applied):
                applied.append(now[joint])
    finally:
        for part in (partial(robot.send_joints, {joint: start}), leave):
            with suppress(CellwrightError, RunEndedError):  # there may be nobody left to tell
                part()
    if len(seen) < _FEWEST:
        raise UsageError(f"{joint}: only {len(seen)} joint states came in {wave.duration + TAIL:g} s")
    trace = _trace(joint, told, seen)
    edges = [n / 2 / wave.frequency for n in range(1, 2 * wave.periods + 1)] if wave.shape is Shape.STEP else ()
    figures = tracking(trace, period=1 / wave.frequency, edges=edges)
    return Exercise(wave, start, trace, figures, _held_back(trace.told, applied, wave))


def _trace(joint: str, told: list[tuple[float, float]], seen: list[tuple[float, float, float]]) -> Trace:
    """What was noted, as arrays; the node's own stamps put joint states in time where it gives them."""
    heard_at, stamps, positions = np.array(seen).T
    seen_at: Array = heard_at
    if np.all(np.diff(stamps) > 0.0):
        seen_at = stamps + np.median(heard_at - stamps)
    told_at, targets = np.array(told).T
    return Trace(joint, told_at, targets, seen_at, positions)


def _held_back(told: Array, applied: list[float], wave: Wave) -> str:
    """What the node made of targets that it did not apply as they were."""
    if not applied:
        return ""
    slack = _HELD_BACK * abs(wave.amplitude)
    asked, did = (float(told.min()), float(told.max())), (min(applied), max(applied))
    if did[0] > asked[0] + slack or did[1] < asked[1] - slack:
        return f"asked for {asked[0]:.4g} to {asked[1]:.4g}, applied {did[0]:.4g} to {did[1]:.4g}: the node holds back"
    return ""
