"""Motion check: moves each joint of a robot, or compares with its reference motion, and proposes accelerations."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import mujoco
import numpy as np

from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.groups import groups
from cellwright.config.robot.model import Joint
from cellwright.robot.checks.reference import compare, find_reference, read_reference
from cellwright.robot.checks.rig import Finding, MotionReport, Rig
from cellwright.robot.homing import HOMING_TIMEOUT
from cellwright.robot.node import RobotNode
from cellwright.robot.servos import Array, fastest

INERTIA_SHARE = 0.7
"""Share of the effort for inertia; the rest is for forces that depend on speed."""
RAMP = 0.05
"""Minimum time to full speed [s]: a time below the servo's own lag would have no effect."""
POSTURES = 30
"""Number of examined postures besides the initial one; the same in each check."""

_MAX_POSITION = math.pi  # [rad; m] from 0: limit of random positions for joints with wide ranges
_MIN_ACCELERATION = 1e-3  # [rad/s^2; m/s^2]; proposals are above 0, also for a joint that cannot move
_DIGITS = 2  # digits of a proposed figure
STEP_SHARE = 0.1
"""Motion of a joint, as a share of its range."""
UNLIMITED_STEP = 0.3
"""Motion of a joint without limits [rad; m]."""
SETTLED = 0.02
"""Tolerance at the target, as a share of the motion."""
OVERSHOOT = 0.25
"""Maximum overshoot, as a share of the motion: a drive at its effort limit brakes late."""
STRAY = 0.05
"""Maximum motion of joints without commands while another one moves [rad; m]: 5 cm at a reach of 1 m."""
SETTLING_TIMEOUT = 1.0
"""Maximum settling time beyond the minimum time of the motion, by its limits of speed and acceleration [s]."""
DRIFT = 1e-3
"""Maximum motion of a joint from the initial posture without commands [rad; m]."""
_MAX_GRIPPER_TIME = 20.0  # [s]


def bearable_accelerations(rig: Rig) -> dict[str, float]:
    """Return accelerations of the driven joints at which no drive reaches its effort limit [rad/s^2; m/s^2], by joint.

    A drive at its effort limit lets its joint overshoot or stray. The acceleration of one joint alone is effort over
    inertia, both of its own drive and of all drives that hold against it, as the minimum over some postures. All are
    then lowered until each drive bears all joints at once. Their efforts add up by their squares, as independent ones
    do, since they seldom all pull the same way.
    """
    inertias = np.abs(_inertias(rig))
    limits = [joint.limits.effort for joint in rig.config.robot.driven]
    efforts = INERTIA_SHARE * np.array([limit if limit > 0.0 else math.inf for limit in limits])
    with np.errstate(divide="ignore"):
        alone = (efforts[:, None] / inertias).min(axis=(0, 1))
    alone = np.minimum(alone, np.array([fastest(joint) for joint in rig.config.robot.driven]) / RAMP)
    loads = (np.sqrt(((inertias * alone) ** 2).sum(axis=2)) / efforts).max(axis=0)
    shared = np.where(inertias.max(axis=0) > 0.0, np.maximum(loads, 1.0)[:, None], 1.0).max(axis=0)
    found: Array = alone / shared
    return {joint.name: value for joint, value in zip(rig.config.robot.driven, found.tolist(), strict=True)}


def _inertias(rig: Rig) -> Array:
    """Return the inertia that each drive feels of each joint's acceleration (postures, drives, joints)."""
    rig.begin()
    model, first = rig.node.simulation.model, rig.node.simulation.data.qpos.copy()
    joints = rig.config.robot.driven
    places = np.array([model.joint(joint.name).qposadr[0] for joint in joints])
    dofs = np.array([model.joint(joint.name).dofadr[0] for joint in joints])
    lower = np.array([max(joint.limits.lower, -_MAX_POSITION) for joint in joints])
    upper = np.array([min(joint.limits.upper, _MAX_POSITION) for joint in joints])
    rng, data = np.random.default_rng(0), mujoco.MjData(model)
    whole = np.zeros((model.nv, model.nv))
    found = np.empty((POSTURES + 1, len(joints), len(joints)))
    for number in range(POSTURES + 1):
        data.qpos[:] = first
        if number:
            data.qpos[places] = lower + rng.random(len(joints)) * (upper - lower)
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, whole)
        found[number] = whole[np.ix_(dofs, dofs)]
    return found


def propose_accelerations(rig: Rig, joints: Sequence[str]) -> str:
    """Return configuration entries for the groups of some joints, and a figure for each joint without a group."""
    known = bearable_accelerations(rig)
    entries = [
        f"{key}.max_acceleration: {_format_figures(rig.config, key, members, known)}"
        for key, members, _ in groups(rig.config)
        if set(members) & set(joints)
    ]
    grouped = {name for _, members, _ in groups(rig.config) for name in members}
    alone = [f"{name} {_format_figure(known[name])}" for name in joints if name not in grouped]
    if alone:
        entries.append(f"max_acceleration of a group with {', '.join(alone)}")
    return f"drives reach their effort limits; add to the configuration: {'; '.join(entries)}"


def _format_figures(config: RobotConfig, key: str, members: tuple[str, ...], known: Mapping[str, float]) -> str:
    """Format one figure for each place in the list of a group's joints; the head's has three."""
    figures = [_format_figure(known[name]) for name in members]
    if key == "head":
        figures = [figures[config.head_axes.index(axis)] if axis in config.head_axes else "1" for axis in range(3)]
    return f"[{', '.join(figures)}]"


def _format_figure(value: float) -> str:
    """Format a value with few digits, rounded down."""
    value = max(value, _MIN_ACCELERATION)
    scale = 10.0 ** (math.floor(math.log10(value)) - _DIGITS + 1)
    return f"{math.floor(value / scale) * scale:g}"


@dataclass
class Worst:
    """Worst of several figures, with its joint; in `beyond`, the joints whose figures exceed the limit."""

    limit: float
    name: str = ""
    value: float = 0.0
    count: int = 0
    beyond: list[str] = field(default_factory=list)

    def add(self, name: str, value: float, owner: str = "") -> None:
        """Take a figure into account; with `owner`, a figure of another joint than the one at fault."""
        self.count += 1
        if value > self.limit:
            self.beyond.append(name)
        if not self.name or value > self.value:
            self.name, self.value = f"{owner}, while {name} moves" if owner else name, value


class Response(NamedTuple):
    """Response of a robot to a step of one joint."""

    late: float
    """Settling time beyond the minimum time of the motion [s]; infinite if the joint does not settle."""
    beyond: float
    """Overshoot, as a share of the motion."""
    stray: float
    """Largest motion among the joints without commands [rad; m]."""
    strayed_joint: str


def check_joints(rig: Rig) -> Iterator[Finding]:
    """Hold still, then move every driven joint in turn; yield a finding for each joint that fails."""
    rig.begin()
    begin = rig.positions
    _, positions = rig.run(0.5)
    expected = tuple(joint.name for joint in rig.config.robot.movable)
    yield Finding(f"order of {len(expected)} joint states", 0, 0, "differ", "", rig.joint_states == expected)
    if not rig.numbers:
        return
    names = tuple(rig.numbers)
    drift = np.abs(positions - begin).max(axis=0)
    worst = int(drift.argmax())
    passed = bool(drift[worst] <= DRIFT)
    yield Finding("holds the initial posture", 1e3 * drift[worst], 1e3 * DRIFT, "mrad; mm", names[worst], passed)
    yield from _steps(rig)
    for number in range(len(rig.config.grippers)):
        yield _check_gripper(rig, number)
    if rig.config.home:
        yield _check_homing(rig)


def _steps(rig: Rig) -> Iterator[Finding]:
    """Move each joint alone; yield a finding for each that does not arrive, and the worst figures of all joints."""
    late, beyond, stray = Worst(SETTLING_TIMEOUT), Worst(OVERSHOOT), Worst(STRAY)
    for joint in rig.config.robot.driven:
        if joint.mimic is not None:
            continue
        why = _immovable_reason(joint)
        if not why:
            response = _step_joint(rig, joint)
            beyond.add(joint.name, response.beyond)
            stray.add(joint.name, response.stray, response.strayed_joint)
            if math.isfinite(response.late):
                late.add(joint.name, response.late)
                continue
            why = f"it does not settle within {100 * SETTLED:.0f} % of the step"
        yield Finding(joint.name, math.inf, SETTLING_TIMEOUT, "s late", why, passed=False)
    if late.count:
        yield Finding(f"settling time of {late.count} joints", late.value, SETTLING_TIMEOUT, "s late", late.name)
    if not beyond.count:
        return
    to_blame = tuple(dict.fromkeys((*beyond.beyond, *stray.beyond)))
    remedy = propose_accelerations(rig, to_blame) if to_blame else ""
    title, where, advice = "largest overshoot", beyond.name, remedy if beyond.beyond else ""
    yield Finding(title, 100 * beyond.value, 100 * OVERSHOOT, "% of step", where, not beyond.beyond, remedy=advice)
    title, where, advice = (
        "largest motion of other joints",
        stray.name if stray.value else "",
        "" if beyond.beyond else remedy,
    )
    yield Finding(title, 1e3 * stray.value, 1e3 * STRAY, "mrad; mm", where, not stray.beyond, remedy=advice)


def _immovable_reason(joint: Joint) -> str:
    """Return the reason why a joint cannot move at all."""
    limits = joint.limits
    if limits.upper <= limits.lower:
        return f"its limits leave no range: {limits.lower:g} to {limits.upper:g}"
    for name, value in (("effort", limits.effort), ("velocity", limits.velocity)):
        if value <= 0.0:
            return f"its {name} limit is {value:g}"
    return ""


def _step_joint(rig: Rig, joint: Joint) -> Response:
    """Step a joint, and measure it and all others."""
    rig.begin()
    number, limits = rig.numbers[joint.name], joint.limits
    begin = rig.positions
    others = np.array([each != joint.name and rig.config.robot.joint(each).mimic is None for each in rig.numbers])
    start = float(begin[number])
    target = _nearby_position(joint, start)
    min_time = _min_time(abs(target - start), limits.velocity, rig.config.max_accelerations.get(joint.name, math.inf))
    rig.send({joint.name: target})
    settled, beyond, since = math.inf, 0.0, 0.0
    away = np.zeros(len(begin))
    while since < min_time + SETTLING_TIMEOUT:
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
    return Response(max(0.0, settled - min_time), beyond, float(away[worst]), tuple(rig.numbers)[worst])


def _min_time(way: float, speed: float, acceleration: float) -> float:
    """Return the minimum time of a motion from rest to rest [s].

    Args:
        way: [rad; m].
        speed: limit [rad/s; m/s].
        acceleration: limit [rad/s^2; m/s^2].
    """
    if math.isinf(acceleration):
        return way / speed
    ramp = min(speed / acceleration, math.sqrt(way / acceleration))
    return 2 * ramp + (way - acceleration * ramp * ramp) / min(speed, acceleration * ramp)


def _check_gripper(rig: Rig, number: int) -> Finding:
    """Close a gripper, and measure how far it closes."""
    gripper = rig.config.grippers[number]
    named = [rig.config.robot.joint(name) for name in gripper.joints]
    joints = [
        joint for joint in named if joint.mimic is None
    ]  # those that mimic may go to the other ends of their ranges
    ways = [joint.limits.upper - joint.limits.lower for joint in joints]
    rig.begin()
    rig.send_grippers([float(each == number) for each in range(len(rig.config.grippers))])
    max_time = max((way / joint.limits.velocity for way, joint in zip(ways, joints, strict=True)), default=0.0)
    _, positions = rig.run(min(max_time, _MAX_GRIPPER_TIME) + SETTLING_TIMEOUT)
    short = [
        abs(gripper.open_and_closed(joint)[1] - float(positions[-1][rig.numbers[joint.name]])) / way
        if way > 0
        else math.inf
        for way, joint in zip(ways, joints, strict=True)
    ]
    worst = max(range(len(short)), key=short.__getitem__)
    figure = 100 * short[worst]
    title = f"{('right', 'left')[number] if number < 2 else number} gripper closes"
    return Finding(title, figure, 100 * SETTLED, "% short", joints[worst].name, short[worst] <= SETTLED)


def _check_homing(rig: Rig) -> Finding:
    """Go home from another posture."""
    rig.begin()
    rig.send({name: _nearby_position(rig.config.robot.joint(name), value) for name, value in rig.config.home.items()})
    rig.run(1.0)
    duration, why_not = rig.reset()
    return Finding("homing time", duration, HOMING_TIMEOUT, "s", why_not, not why_not)


def _nearby_position(joint: Joint, position: float) -> float:
    """Return a reachable position near another [rad; m]."""
    limits = joint.limits
    whole = limits.upper - limits.lower
    way = STEP_SHARE * whole if math.isfinite(whole) else UNLIMITED_STEP
    return position + way if position + way <= limits.upper else position - way


def check_motion(node: RobotNode, on_finding: Callable[[Finding], None] = lambda _finding: None) -> MotionReport:
    """Move a robot in its node as a client would, and measure its motion.

    A robot with a recorded motion beside its configuration is compared with that (recorded with the default timestep).
    Each joint of any other robot is moved alone, from the initial posture.

    Args:
        node: the robot's node.
        on_finding: called with each finding as it is made.

    Raises:
        UsageError: the recorded motion cannot be read.
    """
    rig, path = Rig(node), find_reference(node.config)
    found: list[Finding] = []
    for finding in check_joints(rig) if path is None else compare(rig, read_reference(path)):
        found.append(finding)
        on_finding(finding)
    return MotionReport(node.config.name, "" if path is None else str(path), tuple(found))
