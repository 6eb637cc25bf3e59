"""Reference motion: reads what was recorded of a robot, and compares its motion with it.

Its own key `about` says how samples are counted.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cellwright.config.parsing.sources import read_at_most
from cellwright.config.parsing.tree import Place, Problem, shortened
from cellwright.config.robot.config import RobotConfig
from cellwright.robot.checks.rig import Finding, Rig
from cellwright.robot.servos import Array
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose, Vector3

MAX_FILE_SIZE = 64 << 20
"""A larger file is not read [bytes]."""
REFERENCE_FILE = "reference_motion.json"


@dataclass(frozen=True)
class Hand:
    """Where a link is in the world, with the robot as it is put up."""

    link: str
    pose: Pose


@dataclass(frozen=True)
class Closing:
    """A gripper that is told a status once: its status, 0 to 1, at times since then [s]."""

    gripper: int
    status: float
    times: Array
    statuses: Array


@dataclass(frozen=True)
class GripperMapping:
    """Where the joints of a gripper are [rad; m] for a status."""

    gripper: int
    status: float
    positions: tuple[float, ...]


@dataclass(frozen=True)
class Step:
    """A joint that is told a target once: its positions [rad; m] at times since then [s]."""

    joint: str
    start: float
    target: float
    times: Array
    positions: Array


@dataclass(frozen=True)
class Sine:
    """A joint that is told target after target, and where it is when the next one comes [s; rad; m]."""

    joint: str
    period: float
    targets: Array
    positions: Array


@dataclass(frozen=True)
class ReferenceMotion:
    """All that was recorded of a robot.

    Attributes:
        joints: names of the joint states, in their order.
        hands: poses at home.
        gripper_joints: of each gripper, right and left.
        mappings: what a status means.
        closings: grippers on their way.
        steps: responses to one target.
        sines: responses to many.
    """

    joints: tuple[str, ...]
    hands: tuple[Hand, ...]
    gripper_joints: tuple[tuple[str, ...], ...]
    mappings: tuple[GripperMapping, ...]
    closings: tuple[Closing, ...]
    steps: tuple[Step, ...]
    sines: tuple[Sine, ...]


def find_reference(config: RobotConfig) -> Path | None:
    """The recorded motion that comes with a robot; None if none does."""
    path = config.path.parent / REFERENCE_FILE
    return path if path.is_file() else None


def read_reference(path: Path) -> ReferenceMotion:
    """Read a recorded motion.

    Raises:
        UsageError: it cannot be read, or is none.
    """
    try:
        content = read_at_most(path, MAX_FILE_SIZE)
        if content is None:
            raise UsageError(f"{path}: this is no recorded motion: larger than {MAX_FILE_SIZE >> 20} MiB")
        return _read_motion(json.loads(content.decode("utf-8")))
    except OSError as error:
        raise UsageError(f"cannot read {path}: {error.strerror or error}") from error
    except (ValueError, OverflowError, KeyError, TypeError, IndexError, AttributeError, RecursionError) as error:
        message = f"this is no recorded motion: {type(error).__name__}: {error}"
        raise UsageError(str(Problem(Place(0, str(path), 0), "", shortened(message, 300)))) from error


def _read_motion(read: dict[str, Any]) -> ReferenceMotion:
    second = float(read["steps_per_second"])
    grippers = read["grippers"]
    return ReferenceMotion(
        joints=tuple(map(str, read["joints"])),
        hands=tuple(Hand(each["link"], _read_pose(each["position"], each["orientation"])) for each in read["hands"]),
        gripper_joints=tuple(tuple(each["joints"]) for each in grippers),
        mappings=tuple(
            GripperMapping(number, float(known["status"]), tuple(_numbers(known["joints"]).tolist()))
            for number, each in enumerate(grippers)
            for known in each["positions"]
        ),
        closings=tuple(
            Closing(int(each["gripper"]), float(each["status"]), *_read_samples(each["samples"], second))
            for each in read["closing"]
        ),
        steps=tuple(
            Step(each["joint"], float(each["start"]), float(each["target"]), *_read_samples(each["samples"], second))
            for each in read["steps"]
        ),
        sines=tuple(_read_sine(each) for each in read["sines"]),
    )


def _read_samples(samples: list[list[float]], second: float) -> tuple[Array, Array]:
    steps, values = _numbers(samples).T
    return steps / second, values


def _read_sine(read: dict[str, Any]) -> Sine:
    _, targets, positions = _numbers(read["samples"]).T
    return Sine(read["joint"], 1.0 / float(read["rate"]), targets, positions)


def _read_pose(position: list[float], xyzw: list[float]) -> Pose:
    x, y, z, w = _numbers(xyzw) / np.linalg.norm(_numbers(xyzw))
    position = _numbers(position).tolist()
    at: Vector3 = (float(position[0]), float(position[1]), float(position[2]))
    return Pose(at, (float(w), float(x), float(y), float(z)))


def _numbers(values: Any) -> Array:
    """Numbers as an array; with one that is not finite, a comparison would come out well whatever was measured."""
    found: Array = np.array(values, dtype=np.float64)
    if not np.isfinite(found).all():
        raise ValueError("a number is not finite")
    return found


MAX_RANGE_ERROR = 0.05
"""How far a response may be off, as a share of its range: of the way of a step, of the whole swing of a sine."""
MAX_TIME_ERROR = 0.020
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


def compare(rig: Rig, reference: ReferenceMotion) -> Iterator[Finding]:
    """All comparisons, one after another; the robot moves for it."""
    rig.begin()
    rig.run(0.1)
    yield _order(rig, reference)
    for hand in reference.hands:
        yield from _hand(rig, hand)
    yield from _mappings(rig, reference)
    for closing in reference.closings:
        yield _closing(rig, closing)
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
    if hand.link not in rig.config.robot.links:
        yield Finding(
            f"{hand.link} at home", math.inf, 1e3 * HAND_POSITION, "mm", "there is no such link", passed=False
        )
        return
    pose = rig.link_pose(hand.link)
    away, turned = math.dist(pose.position, hand.pose.position), _angle(pose, hand.pose)
    yield Finding(f"{hand.link} at home", 1e3 * away, 1e3 * HAND_POSITION, "mm", "", away <= HAND_POSITION)
    yield Finding(f"{hand.link} at home", 1e3 * turned, 1e3 * HAND_ANGLE, "mrad", "", turned <= HAND_ANGLE)


def _mappings(rig: Rig, reference: ReferenceMotion) -> Iterator[Finding]:
    """Each gripper goes to each status; its joints are looked at when they stand."""
    for gripper, names in enumerate(reference.gripper_joints):
        known = [mapping for mapping in reference.mappings if mapping.gripper == gripper]
        if not known:
            continue
        what = f"{_side(gripper)}, joints for {len(known)} statuses"
        if gripper >= len(rig.config.grippers) or rig.config.grippers[gripper].joints != names:
            yield Finding(what, math.inf, 1e3 * GRIPPER_JOINT, "mrad", "it has other joints", passed=False)
            continue
        worst, where = max((_mapping(rig, mapping, names) for mapping in known), key=lambda found: found[0])
        yield Finding(what, 1e3 * worst, 1e3 * GRIPPER_JOINT, "mrad", where, worst <= GRIPPER_JOINT)


def _mapping(rig: Rig, mapping: GripperMapping, names: tuple[str, ...]) -> tuple[float, str]:
    rig.begin()
    _command_gripper(rig, mapping.gripper, mapping.status)
    _, positions = rig.run(_CLOSED)
    off = np.abs(positions[-1][[rig.numbers[name] for name in names]] - mapping.positions)
    return float(off.max()), f"{names[int(off.argmax())]} at {mapping.status:g}"


def _closing(rig: Rig, closing: Closing) -> Finding:
    rig.begin()
    what = f"{_side(closing.gripper)}, to {closing.status:g}"
    if closing.gripper >= len(rig.config.grippers):
        return Finding(what, math.inf, 100 * GRIPPER, "%", "there is no such gripper", passed=False)
    gripper = rig.config.grippers[closing.gripper]
    chosen = [rig.numbers[name] for name in gripper.joints]
    ways = np.array([gripper.way(rig.config.robot.joint(name)) for name in gripper.joints])
    begin, way = ways[:, 0], ways[:, 1] - ways[:, 0]
    _command_gripper(rig, closing.gripper, closing.status)
    times, positions = rig.run(float(closing.times[-1]))
    statuses = ((positions[:, chosen] - begin) * np.sign(way)).sum(axis=1) / np.abs(way).sum()
    off = np.abs(np.interp(closing.times, times, statuses) - closing.statuses)
    worst = int(off.argmax())
    where = f"{closing.times[worst]:.3f} s"
    return Finding(what, 100 * off[worst], 100 * GRIPPER, "%", where, bool(off[worst] <= GRIPPER))


def _step(rig: Rig, step: Step) -> Finding:
    what = f"{step.joint}, step {_short(step.start)} to {_short(step.target)}"
    if step.joint not in rig.numbers:
        return Finding(what, math.inf, 100 * MAX_RANGE_ERROR, "%", "there is no such joint", passed=False)
    rig.begin()
    rig.send({step.joint: step.target})
    times, positions = rig.run(float(step.times[-1]))
    whole = abs(float(step.positions[-1]) - step.start)
    return _response(what, times, positions[:, rig.numbers[step.joint]], step.times, step.positions, whole)


def _sine(rig: Rig, sine: Sine) -> Finding:
    """Each target is sent at the first step at or after it is due, as by a client of the node."""
    what = f"{sine.joint}, sine at {1 / sine.period:g} commands/s"
    if sine.joint not in rig.numbers:
        return Finding(what, math.inf, 100 * MAX_RANGE_ERROR, "%", "there is no such joint", passed=False)
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
    far = np.flatnonzero(off > MAX_RANGE_ERROR)
    shifts = [_shift(times, found, at[number], wanted[number]) for number in far]
    worst = int(far[int(np.argmax(shifts))]) if len(far) and max(shifts) > MAX_TIME_ERROR else int(np.argmax(off))
    note = ""
    if len(far):
        by = (
            f"by {1e3 * max(shifts):.0f} ms"
            if max(shifts) <= MAX_TIME_ERROR
            else f"and by more than {1e3 * MAX_TIME_ERROR:.0f} ms"
        )
        note = f"{len(far)} of {len(at)} samples are off by more than {100 * MAX_RANGE_ERROR:g} %, {by}"
    passed = not len(far) or max(shifts) <= MAX_TIME_ERROR
    return Finding(what, 100 * float(off[worst]), 100 * MAX_RANGE_ERROR, "%", f"{at[worst]:.3f} s", passed, note)


def _shift(times: Array, found: Array, time: float, value: float) -> float:
    """How much earlier or later a response has a value [s]; infinite when by more than `TIME`."""
    for shift in np.arange(0.0, MAX_TIME_ERROR + 1e-9, _TICK):
        low, high = time - shift, time + shift
        around = [*np.interp((low, high), times, found), *found[(times > low) & (times < high)]]
        if min(around) <= value <= max(around):
            return float(shift)
    return math.inf


def _command_gripper(rig: Rig, gripper: int, status: float) -> None:
    rig.send_grippers([status if number == gripper else 0.0 for number in range(len(rig.config.grippers))])


def _angle(one: Pose, other: Pose) -> float:
    """By how much one is turned against the other [rad]."""
    w, *xyz = (one.inverse() @ other).quaternion
    return 2 * math.atan2(math.hypot(*xyz), abs(w))


def _short(value: float) -> str:
    return f"{round(value, 2) + 0.0:g}"


def _side(gripper: int) -> str:
    return f"{('right', 'left')[gripper]} gripper" if gripper < 2 else f"gripper {gripper}"
