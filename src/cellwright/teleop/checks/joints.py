"""Moves each joint of a robot by itself: a check of a robot that nothing was recorded of."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cellwright.description.robot.config import RobotConfig
from cellwright.description.robot.model import Joint
from cellwright.teleop.checks.findings import Finding
from cellwright.teleop.checks.rig import Rig
from cellwright.teleop.home import TIME

SHARE = 0.1
"""By how much of its range a joint is moved."""
ENDLESS = 0.3
"""By how much a joint without limits is moved [rad; m]."""
SETTLED = 0.02
"""How near a joint comes to its target, as a share of its way."""
OVERSHOOT = 0.25
"""How far it may go beyond, as a share of its way: a drive at the limit of its effort brakes late."""
PATIENCE = 1.0
"""How much longer a joint may take than its way at full speed takes [s]."""
DRIFT = 1e-3
"""How far a joint may go from where the robot was put up, with nothing commanded [rad; m]."""

_LONGEST = 20.0  # [s] that a gripper is waited for


@dataclass
class Worst:
    """The worst of several figures, and whose it is."""

    name: str = ""
    value: float = 0.0
    count: int = 0

    def look(self, name: str, value: float) -> None:
        """Take one more into account."""
        self.count += 1
        if not self.name or value > self.value:
            self.name, self.value = name, value


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
    late, beyond = Worst(), Worst()
    for joint in config.robot.driven:
        if joint.mimic is not None:
            continue
        why = _cannot(joint)
        took, over = (math.inf, 0.0) if why else _move(rig, joint)
        if not why and math.isinf(took):
            why = f"it does not come within {100 * SETTLED:.0f} % of its target"
        if why:
            yield Finding(joint.name, math.inf, PATIENCE, "s late", why, passed=False)
            continue
        late.look(joint.name, took)
        beyond.look(joint.name, 100 * over)
    if late.count:
        yield Finding(f"{late.count} joints step and settle", late.value, PATIENCE, "s late", late.name)
        passed = beyond.value <= 100 * OVERSHOOT
        yield Finding("the farthest goes beyond", beyond.value, 100 * OVERSHOOT, "% of way", beyond.name, passed)
    for number in range(len(config.grippers)):
        yield _gripper(rig, config, number)
    if config.home:
        yield _home(rig, config)


def _cannot(joint: Joint) -> str:
    """Why a joint cannot move at all."""
    limits = joint.limits
    if limits.upper <= limits.lower:
        return f"its limits leave no way: {limits.lower:g} to {limits.upper:g}"
    for name, value in (("effort", limits.effort), ("velocity", limits.velocity)):
        if value <= 0.0:
            return f"its {name} limit is {value:g}"
    return ""


def _move(rig: Rig, joint: Joint) -> tuple[float, float]:
    """How much longer than at full speed a joint takes to settle [s], and how far it goes beyond, as a share."""
    rig.begin()
    number, limits = rig.numbers[joint.name], joint.limits
    start = float(rig.positions[number])
    target = _aside(joint, start)
    least = abs(target - start) / limits.velocity
    rig.send({joint.name: target})
    settled, beyond, since = math.inf, 0.0, 0.0
    while since < least + PATIENCE:
        share = (float(rig.step()[number]) - start) / (target - start)
        since += rig.timestep
        beyond = max(beyond, share - 1.0)
        if abs(share - 1.0) > SETTLED:
            settled = math.inf
        elif math.isinf(settled):
            settled = since
        elif since > settled + 0.1:
            break
    return max(0.0, settled - least), beyond


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
