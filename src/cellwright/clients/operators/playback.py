"""Plays targets to a robot: slowly to the first of them, then as they come."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from cellwright.clients.operators.limits import JointLimits
from cellwright.clients.operators.robot import GRIPPER_COMMAND, OperatedRobot
from cellwright.clients.operators.target_files import Moment, Targets
from cellwright.util.errors import UsageError

SPEED = 0.5
"""Of the slow motion to the first targets, at its fastest [rad/s; m/s]."""
RATE = 100.0
"""Commands a second on that way [Hz]."""

_NEAR = 0.05  # [rad; m] from the first targets, that is near enough to begin
_PATIENCE = 2.0  # [s] to get there when all has been said
_SHORTEST = 0.5  # [s]


def check(robot: OperatedRobot, targets: Targets, limits: JointLimits) -> None:
    """Refuse targets that the robot cannot be given.

    Raises:
        UnknownNameError: they name a joint that it has not.
        UsageError: they would leave its limits, it has not as many grippers, or it takes no commands or does
            not say where a joint is.
    """
    robot.check_names(targets.first)
    for name in targets.first:
        robot.position(name)
    for name, (low, high) in targets.reach.items():
        limits.check(name, low, high, str(targets.path))
    grippers = max((len(each.values) for each in targets.moments if each.topic == GRIPPER_COMMAND), default=0)
    if robot.grippers and grippers > len(robot.grippers):
        raise UsageError(f"{targets.path}: targets of {grippers} grippers, and the robot has {len(robot.grippers)}")
    robot.check_ready()


def approach(
    robot: OperatedRobot,
    first: Mapping[str, float],
    duration: float | None = None,
    *,
    on_beat: Callable[[float], None] = lambda _time: None,
) -> None:
    """Bring joints to positions [rad; m], from where they stand, without haste at either end.

    Args:
        robot: whose joints they are.
        first: where each is to go.
        duration: how long it may take [s]; None: as long as the farthest needs at `SPEED`.
        on_beat: told after each command how long it has taken so far [s].

    Raises:
        UsageError: a joint did not get there.
    """
    session = robot.session
    start = {name: robot.position(name) for name in first}
    farthest = max((abs(first[name] - start[name]) for name in first), default=0.0)
    if duration is None:
        duration = max(_SHORTEST, farthest * math.pi / 2 / SPEED)  # at its middle a cosine is pi/2 as fast
    begun, beat = session.time, session.rate(RATE)
    part = 0.0
    while part < 1.0 and first:
        part = 1.0 if duration <= 0.0 else min(1.0, (session.time - begun) / duration)
        blend = 0.5 - 0.5 * math.cos(math.pi * part)
        robot.send_joints({name: start[name] + blend * (first[name] - start[name]) for name in first})
        on_beat(session.time - begun)
        beat.sleep()

    def missing() -> list[str]:
        now = robot.positions
        return [name for name in first if abs(now.get(name, math.inf) - first[name]) > _NEAR]

    if not session.wait_until(lambda: not missing(), _PATIENCE):
        name = missing()[0]
        reason = robot.why_not() or "something holds it back"
        raise UsageError(
            f"{name} did not come to the first target: it is at {robot.position(name):.4g}, and "
            f"{first[name]:.4g} was asked for; {reason}"
        )


def play(
    robot: OperatedRobot,
    targets: Targets,
    *,
    speed: float = 1.0,
    on_beat: Callable[[float], None] = lambda _time: None,
) -> None:
    """Say all targets in their time. What is late is not made up for by a rush: of a topic only the newest is said.

    Args:
        robot: to whom.
        targets: what.
        speed: seconds of the file a second.
        on_beat: told after each moment what time of the file it is [s].
    """
    session = robot.session
    begun, origin = session.time, targets.moments[0].time
    moments = targets.moments
    number = 0
    while number < len(moments):
        session.sleep(max(0.0, begun + (moments[number].time - origin) / speed - session.time))
        now = origin + (session.time - begun) * speed
        due: dict[tuple[str, frozenset[str]], Moment] = {}
        while number < len(moments) and (moments[number].time <= now or not due):
            key = (moments[number].topic, frozenset(moments[number].values))
            due.pop(key, None)
            due[key] = moments[number]
            number += 1
        for moment in due.values():
            _say(robot, moment)
        on_beat(moments[number - 1].time - origin)


def _say(robot: OperatedRobot, moment: Moment) -> None:
    if moment.topic == GRIPPER_COMMAND:
        robot.send_grippers(moment.values.values())
    else:
        robot.send_joints(moment.values, moment.topic)
