"""Moves each joint of a robot by itself: a check of a robot that nothing was recorded of."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import Joint
from cellwright.robot.checks.accelerations import proposal
from cellwright.robot.checks.findings import Finding
from cellwright.robot.checks.rig import Rig
from cellwright.robot.home import TIME

SHARE = 0.1
"""By how much of its range a joint is moved."""
ENDLESS = 0.3
"""By how much a joint without limits is moved [rad; m]."""
SETTLED = 0.02
"""How near a joint comes to its target, as a share of its way."""
OVERSHOOT = 0.25
"""How far it may go beyond, as a share of its way: a drive at the limit of its effort brakes late."""
STRAY = 0.05
"""How far joints that nobody commands may go while another one moves [rad; m]: 5 cm at a reach of 1 m."""
PATIENCE = 1.0
"""How much longer a joint may take than its way needs, at full speed and with its bound of acceleration [s]."""
DRIFT = 1e-3
"""How far a joint may go from where the robot was put up, with nothing commanded [rad; m]."""

_LONGEST = 20.0  # [s] that a gripper is waited for


@dataclass
class Worst:
    """The worst of several figures, and whose it is.

    Attributes:
        limit: what they may be.
        name: whose the worst figure is.
        value: that figure.
        count: how many there were.
        beyond: whose figures are greater than the limit.
    """

    limit: float
    name: str = ""
    value: float = 0.0
    count: int = 0
    beyond: list[str] = field(default_factory=list)

    def look(self, name: str, value: float, owner: str = "") -> None:
        """Take one more into account; with `owner`, of another joint than the one that is to blame."""
        self.count += 1
        if value > self.limit:
            self.beyond.append(name)
        if not self.name or value > self.value:
            self.name, self.value = f"{owner}, while {name} moves" if owner else name, value


class Response(NamedTuple):
    """The response of a robot to a step of one joint.

    Attributes:
        late: how much longer the joint takes to settle than its way takes [s]; infinite if it does not settle.
        beyond: how far it goes beyond its target, as a share of its way.
        stray: how far the joint that moves most among those that nobody commanded goes [rad; m].
        who: that joint.
    """

    late: float
    beyond: float
    stray: float
    who: str


def check_joints(rig: Rig, config: RobotConfig) -> Iterator[Finding]:
    """Hold still, then move every driven joint there, one after another; a finding for each joint that does not."""
    rig.begin()
    begin = rig.positions
    _, positions = rig.run(0.5)
    wanted = tuple(joint.name for joint in config.robot.movable)
    yield Finding(f"order of {len(wanted)} joint states", 0, 0, "differ", "", rig.joint_states == wanted)
    if not rig.numbers:
        return
    names = tuple(rig.numbers)
    drift = np.abs(positions - begin).max(axis=0)
    worst = int(drift.argmax())
    yield Finding(
        "holds where it is put up",
        1e3 * drift[worst],
        1e3 * DRIFT,
        "mrad; mm",
        names[worst],
        bool(drift[worst] <= DRIFT),
    )
    yield from _steps(rig, config)
    for number in range(len(config.grippers)):
        yield _gripper(rig, config, number)
    if config.home:
        yield _home(rig, config)


def _steps(rig: Rig, config: RobotConfig) -> Iterator[Finding]:
    """Move each joint by itself; a finding for each that does not come, and the farthest of all, these included."""
    late, beyond, stray = Worst(PATIENCE), Worst(OVERSHOOT), Worst(STRAY)
    for joint in config.robot.driven:
        if joint.mimic is not None:
            continue
        why = _cannot(joint)
        if not why:
            response = _move(rig, joint, config)
            beyond.look(joint.name, response.beyond)
            stray.look(joint.name, response.stray, response.who)
            if math.isfinite(response.late):
                late.look(joint.name, response.late)
                continue
            why = f"it does not come within {100 * SETTLED:.0f} % of its target"
        yield Finding(joint.name, math.inf, PATIENCE, "s late", why, passed=False)
    if late.count:
        yield Finding(f"{late.count} joints step and settle", late.value, PATIENCE, "s late", late.name)
    if not beyond.count:
        return
    to_blame = tuple(dict.fromkeys((*beyond.beyond, *stray.beyond)))
    remedy = proposal(rig, config, to_blame) if to_blame else ""
    yield Finding(
        "the farthest goes beyond",
        100 * beyond.value,
        100 * OVERSHOOT,
        "% of way",
        beyond.name,
        not beyond.beyond,
        remedy=remedy if beyond.beyond else "",
    )
    yield Finding(
        "the farthest strays",
        1e3 * stray.value,
        1e3 * STRAY,
        "mrad; mm",
        stray.name if stray.value else "",
        not stray.beyond,
        remedy="" if beyond.beyond else remedy,
    )


def _cannot(joint: Joint) -> str:
    """Why a joint cannot move at all."""
    limits = joint.limits
    if limits.upper <= limits.lower:
        return f"its limits leave no way: {limits.lower:g} to {limits.upper:g}"
    for name, value in (("effort", limits.effort), ("velocity", limits.velocity)):
        if value <= 0.0:
            return f"its {name} limit is {value:g}"
    return ""


def _move(rig: Rig, joint: Joint, config: RobotConfig) -> Response:
    """Step a joint, and look at it and at all others."""
    rig.begin()
    number, limits = rig.numbers[joint.name], joint.limits
    begin = rig.positions
    others = np.array([each != joint.name and config.robot.joint(each).mimic is None for each in rig.numbers])
    start = float(begin[number])
    target = _aside(joint, start)
    least = _least_time(abs(target - start), limits.velocity, config.max_accelerations.get(joint.name, math.inf))
    rig.send({joint.name: target})
    settled, beyond, since = math.inf, 0.0, 0.0
    away = np.zeros(len(begin))
    while since < least + PATIENCE:
        positions = rig.step()
        away = np.maximum(away, np.abs(positions - begin))
        share = (float(positions[number]) - start) / (target - start)
        since += rig.timestep
        beyond = max(beyond, share - 1.0)
        if abs(share - 1.0) > SETTLED:
            settled = math.inf
        elif math.isinf(settled):
            settled = since
        elif since > settled + 0.1:
            break
    away[~others] = 0.0
    worst = int(away.argmax())
    return Response(max(0.0, settled - least), beyond, float(away[worst]), tuple(rig.numbers)[worst])


def _least_time(way: float, speed: float, acceleration: float) -> float:
    """How long a way from rest to rest takes at least [s]; way [rad; m], speed [rad/s; m/s], acceleration per s^2."""
    if math.isinf(acceleration):
        return way / speed
    ramp = min(speed / acceleration, math.sqrt(way / acceleration))
    return 2 * ramp + (way - acceleration * ramp * ramp) / min(speed, acceleration * ramp)


def _gripper(rig: Rig, config: RobotConfig, number: int) -> Finding:
    """Close a gripper, and see how far it comes."""
    gripper = config.grippers[number]
    named = [config.robot.joint(name) for name in gripper.joints]
    joints = [joint for joint in named if joint.mimic is None]  # others may go to the other ends of their ways
    ways = [joint.limits.upper - joint.limits.lower for joint in joints]
    rig.begin()
    rig.send_grippers([float(each == number) for each in range(len(config.grippers))])
    longest = max((way / joint.limits.velocity for way, joint in zip(ways, joints, strict=True)), default=0.0)
    _, positions = rig.run(min(longest, _LONGEST) + PATIENCE)
    short = [
        abs(gripper.way(joint)[1] - float(positions[-1][rig.numbers[joint.name]])) / way if way > 0 else math.inf
        for way, joint in zip(ways, joints, strict=True)
    ]
    worst = max(range(len(short)), key=short.__getitem__)
    figure = 100 * short[worst]
    what = f"{('right', 'left')[number] if number < 2 else number} gripper closes"
    return Finding(what, figure, 100 * SETTLED, "% short", joints[worst].name, short[worst] <= SETTLED)


def _home(rig: Rig, config: RobotConfig) -> Finding:
    """Go home from elsewhere."""
    rig.begin()
    rig.send({name: _aside(config.robot.joint(name), value) for name, value in config.home.items()})
    rig.run(1.0)
    took, why_not = rig.reset()
    return Finding("goes home on a reset", took, TIME, "s", why_not, not why_not)


def _aside(joint: Joint, position: float) -> float:
    """A place near a position that the joint can go to [rad; m]."""
    limits = joint.limits
    whole = limits.upper - limits.lower
    way = SHARE * whole if math.isfinite(whole) else ENDLESS
    return position + way if position + way <= limits.upper else position - way
