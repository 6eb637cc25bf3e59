"""Compares a robot's motion with what was recorded of it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from cellwright.config.robot.config import RobotConfig
from cellwright.robot.checks.findings import Finding
from cellwright.robot.checks.recorded import Closing, Hand, Mapping, ReferenceMotion, Sine, Step
from cellwright.robot.checks.rig import Rig
from cellwright.robot.servos import Array
from cellwright.util.pose import Pose

RANGE = 0.05
"""How far a response may be off, as a share of its range: of the way of a step, of the whole swing of a sine."""
TIME = 0.020
"""Or how much earlier or later it may be [s]."""
HAND_POSITION, HAND_ANGLE = 1e-3, 1e-3
"""How far a hand may be off at home [m; rad]."""
GRIPPER = 0.03
"""How far the status of a gripper may be off on its way."""
GRIPPER_JOINT = 1e-3
"""How far a joint of a gripper may be off for a status [rad; m]."""

_LEAST = 1e-6  # [rad; m], the range of what did not move
_TICK = 1e-3  # [s], how finely times are told
_CLOSED = 2.0  # [s] within which a gripper of any speed of the recording has closed


def compare(rig: Rig, config: RobotConfig, reference: ReferenceMotion) -> Iterator[Finding]:
    """All comparisons, one after another; the robot moves for it."""
    rig.begin()
    rig.run(0.1)
    yield _order(rig, reference)
    for hand in reference.hands:
        yield from _hand(rig, hand)
    yield from _mappings(rig, config, reference)
    for closing in reference.closings:
        yield _closing(rig, config, closing)
    for step in reference.steps:
        yield _step(rig, step)
    for sine in reference.sines:
        yield _sine(rig, sine)


def _order(rig: Rig, reference: ReferenceMotion) -> Finding:
    found, wanted = rig.joint_states, reference.joints
    count = max(len(found), len(wanted))
    padded = zip(
        found + ("nothing",) * (count - len(found)), wanted + ("nothing",) * (count - len(wanted)), strict=True
    )
    differ = [(number, one, other) for number, (one, other) in enumerate(padded) if one != other]
    where = "" if not differ else f"{differ[0][0]}: {differ[0][1]} instead of {differ[0][2]}"
    return Finding(f"order of {len(wanted)} joint states", len(differ), 0, "differ", where, not differ)


def _hand(rig: Rig, hand: Hand) -> Iterator[Finding]:
    if hand.link not in rig.node.config.robot.links:
        yield Finding(
            f"{hand.link} at home", math.inf, 1e3 * HAND_POSITION, "mm", "there is no such link", passed=False
        )
        return
    pose = rig.link_pose(hand.link)
    away, turned = math.dist(pose.position, hand.pose.position), _angle(pose, hand.pose)
    yield Finding(f"{hand.link} at home", 1e3 * away, 1e3 * HAND_POSITION, "mm", "", away <= HAND_POSITION)
    yield Finding(f"{hand.link} at home", 1e3 * turned, 1e3 * HAND_ANGLE, "mrad", "", turned <= HAND_ANGLE)


def _mappings(rig: Rig, config: RobotConfig, reference: ReferenceMotion) -> Iterator[Finding]:
    """Each gripper goes to each status; its joints are looked at when they stand."""
    for gripper, names in enumerate(reference.gripper_joints):
        known = [mapping for mapping in reference.mappings if mapping.gripper == gripper]
        if not known:
            continue
        what = f"{_side(gripper)}, joints for {len(known)} statuses"
        if gripper >= len(config.grippers) or config.grippers[gripper].joints != names:
            yield Finding(what, math.inf, 1e3 * GRIPPER_JOINT, "mrad", "it has other joints", passed=False)
            continue
        worst, where = max((_mapping(rig, config, mapping, names) for mapping in known), key=lambda found: found[0])
        yield Finding(what, 1e3 * worst, 1e3 * GRIPPER_JOINT, "mrad", where, worst <= GRIPPER_JOINT)


def _mapping(rig: Rig, config: RobotConfig, mapping: Mapping, names: tuple[str, ...]) -> tuple[float, str]:
    rig.begin()
    _command_gripper(rig, config, mapping.gripper, mapping.status)
    _, positions = rig.run(_CLOSED)
    off = np.abs(positions[-1][[rig.numbers[name] for name in names]] - mapping.positions)
    return float(off.max()), f"{names[int(off.argmax())]} at {mapping.status:g}"


def _closing(rig: Rig, config: RobotConfig, closing: Closing) -> Finding:
    rig.begin()
    what = f"{_side(closing.gripper)}, to {closing.status:g}"
    if closing.gripper >= len(config.grippers):
        return Finding(what, math.inf, 100 * GRIPPER, "%", "there is no such gripper", passed=False)
    gripper = config.grippers[closing.gripper]
    chosen = [rig.numbers[name] for name in gripper.joints]
    ways = np.array([gripper.way(config.robot.joint(name)) for name in gripper.joints])
    begin, way = ways[:, 0], ways[:, 1] - ways[:, 0]
    _command_gripper(rig, config, closing.gripper, closing.status)
    times, positions = rig.run(float(closing.times[-1]))
    statuses = ((positions[:, chosen] - begin) * np.sign(way)).sum(axis=1) / np.abs(way).sum()
    off = np.abs(np.interp(closing.times, times, statuses) - closing.statuses)
    worst = int(off.argmax())
    where = f"{closing.times[worst]:.3f} s"
    return Finding(what, 100 * off[worst], 100 * GRIPPER, "%", where, bool(off[worst] <= GRIPPER))


def _step(rig: Rig, step: Step) -> Finding:
    what = f"{step.joint}, step {_short(step.start)} to {_short(step.target)}"
    if step.joint not in rig.numbers:
        return Finding(what, math.inf, 100 * RANGE, "%", "there is no such joint", passed=False)
    rig.begin()
    rig.send({step.joint: step.target})
    times, positions = rig.run(float(step.times[-1]))
    whole = abs(float(step.positions[-1]) - step.start)
    return _response(what, times, positions[:, rig.numbers[step.joint]], step.times, step.positions, whole)


def _sine(rig: Rig, sine: Sine) -> Finding:
    """Each target is sent at the first step at or after it is due, as by a client of the node."""
    what = f"{sine.joint}, sine at {1 / sine.period:g} commands/s"
    if sine.joint not in rig.numbers:
        return Finding(what, math.inf, 100 * RANGE, "%", "there is no such joint", passed=False)
    rig.begin()
    due: Array = np.arange(len(sine.targets), dtype=np.float64) * sine.period
    found, sent = [rig.positions], 0
    while (len(found) - 1) * rig.timestep < due[-1] + sine.period:
        now = (len(found) - 1) * rig.timestep
        while sent < len(due) and due[sent] <= now + 1e-9:
            rig.send({sine.joint: float(sine.targets[sent])})
            sent += 1
        found.append(rig.step())
    times = rig.times(len(found) - 1)
    positions = np.array(found)[:, rig.numbers[sine.joint]]
    whole = float(np.ptp(sine.positions))
    return _response(what, times, positions, due + sine.period, sine.positions, whole)


def _response(what: str, times: Array, found: Array, at: Array, wanted: Array, whole: float) -> Finding:
    """A response against its samples: near enough where it is, or where it was or will be within `TIME`."""
    off = np.abs(np.interp(at, times, found) - wanted) / max(whole, _LEAST)
    far = np.flatnonzero(off > RANGE)
    shifts = [_shift(times, found, at[number], wanted[number]) for number in far]
    worst = int(far[int(np.argmax(shifts))]) if len(far) and max(shifts) > TIME else int(np.argmax(off))
    note = ""
    if len(far):
        by = f"by {1e3 * max(shifts):.0f} ms" if max(shifts) <= TIME else f"and by more than {1e3 * TIME:.0f} ms"
        note = f"{len(far)} of {len(at)} samples are off by more than {100 * RANGE:g} %, {by}"
    passed = not len(far) or max(shifts) <= TIME
    return Finding(what, 100 * float(off[worst]), 100 * RANGE, "%", f"{at[worst]:.3f} s", passed, note)


def _shift(times: Array, found: Array, time: float, value: float) -> float:
    """How much earlier or later a response has a value [s]; infinite when by more than `TIME`."""
    for shift in np.arange(0.0, TIME + 1e-9, _TICK):
        low, high = time - shift, time + shift
        around = [*np.interp((low, high), times, found), *found[(times > low) & (times < high)]]
        if min(around) <= value <= max(around):
            return float(shift)
    return math.inf


def _command_gripper(rig: Rig, config: RobotConfig, gripper: int, status: float) -> None:
    rig.send_grippers([status if number == gripper else 0.0 for number in range(len(config.grippers))])


def _angle(one: Pose, other: Pose) -> float:
    """By how much one is turned against the other [rad]."""
    w, *xyz = (one.inverse() @ other).quaternion
    return 2 * math.atan2(math.hypot(*xyz), abs(w))


def _short(value: float) -> str:
    return f"{round(value, 2) + 0.0:g}"


def _side(gripper: int) -> str:
    return f"{('right', 'left')[gripper]} gripper" if gripper < 2 else f"gripper {gripper}"
