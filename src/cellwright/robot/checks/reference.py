"""Reference motion: reads the recorded motion of a robot, and compares the robot's motion with it.

The file's key `about` describes how samples are counted.
"""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, TypeAlias

import msgspec
import numpy as np
from msgspec import Meta, Struct

from cellwright.config.parsing.sources import read_at_most
from cellwright.config.parsing.tree import Place, Problem, shortened
from cellwright.config.robot.config import RobotConfig
from cellwright.robot.checks.rig import Finding, Rig
from cellwright.robot.servos import Array
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose, Vector3

MAX_FILE_SIZE = 64 << 20
"""Maximum size of the file [bytes]."""
REFERENCE_FILE = "reference_motion.json"

Positive: TypeAlias = Annotated[float, Meta(gt=0.0)]
Samples: TypeAlias = Annotated[list[tuple[float, float]], Meta(min_length=1)]
"""Steps since the command, with the value after each."""

MAX_RANGE_ERROR = 0.05
"""Maximum error of a response, as a share of its range: the height of a step, or peak to peak of a sine."""
MAX_TIME_ERROR = 0.020
"""Alternatively, its maximum error in time [s]."""
HAND_POSITION, HAND_ANGLE = 1e-3, 1e-3
"""Maximum pose error of a hand at home [m; rad]."""
GRIPPER = 0.03
"""Maximum error of a gripper's status while it moves."""
GRIPPER_JOINT = 1e-3
"""Maximum error of a gripper's joint at a status [rad; m]."""
_MIN_RANGE = 1e-6  # [rad; m], range of a response without motion
_TICK = 1e-3  # [s], resolution of the time error
_CLOSING_TIME = 2.0  # [s] within which a gripper of any recorded speed closes


class HandReference(Struct, frozen=True):
    """World pose of a link [m; x, y, z, w] in the initial posture."""

    link: str
    position: Vector3
    orientation: tuple[float, float, float, float]


class GripperPositions(Struct, frozen=True):
    """Positions of a gripper's joints [rad; m] at a status, 0 to 1."""

    status: float
    joints: list[float]


class GripperReference(Struct, frozen=True):
    """Joints of a gripper, and their positions at each status."""

    joints: tuple[str, ...]
    positions: list[GripperPositions]


class Closing(Struct, frozen=True):
    """Gripper that gets one command: its status, 0 to 1, over time."""

    gripper: int
    status: float
    samples: Samples


class StepTarget(Struct, frozen=True):
    """Joint that gets one target: its positions [rad; m] over time."""

    joint: str
    start: float
    target: float
    samples: Samples


class Sine(Struct, frozen=True):
    """Joint that gets targets at a rate [Hz]: time, target, and position when the next target comes."""

    joint: str
    rate: Positive
    samples: Annotated[list[tuple[float, float, float]], Meta(min_length=1)]


class ReferenceMotion(Struct, frozen=True):
    """Recorded motion of a robot; `joints` are the names of the joint states, grippers are right and left."""

    steps_per_second: Positive
    joints: tuple[str, ...]
    hands: list[HandReference]
    grippers: list[GripperReference]
    closing: list[Closing]
    steps: list[StepTarget]
    sines: list[Sine]


def find_reference(config: RobotConfig) -> Path | None:
    """Return the recorded motion beside a robot's configuration; None if there is none."""
    path = config.path.parent / REFERENCE_FILE
    return path if path.is_file() else None


def read_reference(path: Path) -> ReferenceMotion:
    """Read a recorded motion.

    Raises:
        UsageError: the file cannot be read, or is no recorded motion.
    """
    try:
        content = read_at_most(path, MAX_FILE_SIZE)
        if content is None:
            raise UsageError(f"{path}: not a recorded motion: larger than {MAX_FILE_SIZE >> 20} MiB")
        return msgspec.json.decode(content, type=ReferenceMotion)
    except OSError as error:
        raise UsageError(f"cannot read {path}: {error.strerror or error}") from error
    except (msgspec.MsgspecError, RecursionError) as error:
        message = f"not a recorded motion: {error}"
        raise UsageError(str(Problem(Place(0, str(path), 0), "", shortened(message, 300)))) from error


def compare(rig: Rig, reference: ReferenceMotion) -> Iterator[Finding]:
    """Yield all comparisons, one after another; the robot moves for them."""
    rig.begin()
    rig.run(0.1)
    yield _order(rig, reference)
    for hand in reference.hands:
        yield from _hand(rig, hand)
    yield from _mappings(rig, reference)
    for closing in reference.closing:
        yield _closing(rig, closing, *_timed(closing.samples, reference))
    for step in reference.steps:
        yield _step(rig, step, *_timed(step.samples, reference))
    for sine in reference.sines:
        yield _sine(rig, sine)


def _timed(samples: Samples, reference: ReferenceMotion) -> tuple[Array, Array]:
    """Return the times of samples [s], and their values."""
    steps, values = np.array(samples).T
    return steps / reference.steps_per_second, values


def _order(rig: Rig, reference: ReferenceMotion) -> Finding:
    found, expected = rig.joint_states, reference.joints
    count = max(len(found), len(expected))
    padded = zip(
        found + ("nothing",) * (count - len(found)), expected + ("nothing",) * (count - len(expected)), strict=True
    )
    differ = [(number, one, other) for number, (one, other) in enumerate(padded) if one != other]
    where = "" if not differ else f"{differ[0][0]}: {differ[0][1]} instead of {differ[0][2]}"
    return Finding(f"order of {len(expected)} joint states", len(differ), 0, "differ", where, not differ)


def _hand(rig: Rig, hand: HandReference) -> Iterator[Finding]:
    if hand.link not in rig.config.robot.links:
        yield Finding(
            f"{hand.link} at home", math.inf, 1e3 * HAND_POSITION, "mm", "the robot has no such link", passed=False
        )
        return
    x, y, z, w = (np.array(hand.orientation) / np.linalg.norm(hand.orientation)).tolist()
    pose = rig.node.link_pose(hand.link)
    away, turned = math.dist(pose.position, hand.position), _angle(pose, Pose(hand.position, (w, x, y, z)))
    yield Finding(f"{hand.link} at home", 1e3 * away, 1e3 * HAND_POSITION, "mm", "", away <= HAND_POSITION)
    yield Finding(f"{hand.link} at home", 1e3 * turned, 1e3 * HAND_ANGLE, "mrad", "", turned <= HAND_ANGLE)


def _mappings(rig: Rig, reference: ReferenceMotion) -> Iterator[Finding]:
    """Move each gripper to each status, and compare its joints at rest."""
    for number, gripper in enumerate(reference.grippers):
        if not gripper.positions:
            continue
        title = f"{_side(number)}, joints for {len(gripper.positions)} statuses"
        if number >= len(rig.config.grippers) or rig.config.grippers[number].joints != gripper.joints:
            yield Finding(title, math.inf, 1e3 * GRIPPER_JOINT, "mrad", "the gripper has other joints", passed=False)
            continue
        chosen, worst, where = [rig.numbers[name] for name in gripper.joints], -math.inf, ""
        for known in gripper.positions:
            rig.begin()
            _command_gripper(rig, number, known.status)
            _, positions = rig.run(_CLOSING_TIME)
            off = np.abs(positions[-1][chosen] - known.joints)
            if off.max() > worst:
                worst, where = float(off.max()), f"{gripper.joints[int(off.argmax())]} at {known.status:g}"
        yield Finding(title, 1e3 * worst, 1e3 * GRIPPER_JOINT, "mrad", where, worst <= GRIPPER_JOINT)


def _closing(rig: Rig, closing: Closing, at: Array, expected: Array) -> Finding:
    rig.begin()
    title = f"{_side(closing.gripper)}, to {closing.status:g}"
    if closing.gripper >= len(rig.config.grippers):
        return Finding(title, math.inf, 100 * GRIPPER, "%", "the robot has no such gripper", passed=False)
    gripper = rig.config.grippers[closing.gripper]
    chosen = [rig.numbers[name] for name in gripper.joints]
    ways = np.array([gripper.open_and_closed(rig.config.robot.joint(name)) for name in gripper.joints])
    begin, way = ways[:, 0], ways[:, 1] - ways[:, 0]
    _command_gripper(rig, closing.gripper, closing.status)
    times, positions = rig.run(float(at[-1]))
    statuses = ((positions[:, chosen] - begin) * np.sign(way)).sum(axis=1) / np.abs(way).sum()
    off = np.abs(np.interp(at, times, statuses) - expected)
    worst = int(off.argmax())
    return Finding(title, 100 * off[worst], 100 * GRIPPER, "%", f"{at[worst]:.3f} s", bool(off[worst] <= GRIPPER))


def _step(rig: Rig, step: StepTarget, at: Array, expected: Array) -> Finding:
    title = f"{step.joint}, step {_format_short(step.start)} to {_format_short(step.target)}"
    if step.joint not in rig.numbers:
        return Finding(title, math.inf, 100 * MAX_RANGE_ERROR, "%", "the robot has no such joint", passed=False)
    rig.begin()
    rig.send({step.joint: step.target})
    times, positions = rig.run(float(at[-1]))
    whole = abs(float(expected[-1]) - step.start)
    return _response(title, times, positions[:, rig.numbers[step.joint]], at, expected, whole)


def _sine(rig: Rig, sine: Sine) -> Finding:
    """Compare the response to a sine; each target is sent at the first step at or after its time, as by a client."""
    title, period = f"{sine.joint}, sine at {sine.rate:g} commands/s", 1.0 / sine.rate
    if sine.joint not in rig.numbers:
        return Finding(title, math.inf, 100 * MAX_RANGE_ERROR, "%", "the robot has no such joint", passed=False)
    rig.begin()
    _, targets, expected = np.array(sine.samples).T
    due: Array = np.arange(len(targets), dtype=np.float64) * period
    found, sent = [rig.positions], 0
    while (len(found) - 1) * rig.timestep < due[-1] + period:
        now = (len(found) - 1) * rig.timestep
        while sent < len(due) and due[sent] <= now + 1e-9:
            rig.send({sine.joint: float(targets[sent])})
            sent += 1
        found.append(rig.step())
    times = rig.times(len(found) - 1)
    positions = np.array(found)[:, rig.numbers[sine.joint]]
    return _response(title, times, positions, due + period, expected, float(np.ptp(expected)))


def _response(title: str, times: Array, found: Array, at: Array, expected: Array, whole: float) -> Finding:
    """Compare a response with its samples: near enough at the same time, or at another one within `MAX_TIME_ERROR`."""
    off = np.abs(np.interp(at, times, found) - expected) / max(whole, _MIN_RANGE)
    far = np.flatnonzero(off > MAX_RANGE_ERROR)
    shifts = [_shift(times, found, at[number], expected[number]) for number in far]
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
    return Finding(title, 100 * float(off[worst]), 100 * MAX_RANGE_ERROR, "%", f"{at[worst]:.3f} s", passed, note)


def _shift(times: Array, found: Array, time: float, value: float) -> float:
    """Return by how much earlier or later a response has a value [s]; infinite beyond `MAX_TIME_ERROR`."""
    for shift in np.arange(0.0, MAX_TIME_ERROR + 1e-9, _TICK):
        low, high = time - shift, time + shift
        around = [*np.interp((low, high), times, found), *found[(times > low) & (times < high)]]
        if min(around) <= value <= max(around):
            return float(shift)
    return math.inf


def _command_gripper(rig: Rig, gripper: int, status: float) -> None:
    rig.send_grippers([status if number == gripper else 0.0 for number in range(len(rig.config.grippers))])


def _angle(one: Pose, other: Pose) -> float:
    """Return the rotation between two poses [rad]."""
    w, *xyz = (one.inverse() @ other).quaternion
    return 2 * math.atan2(math.hypot(*xyz), abs(w))


def _format_short(value: float) -> str:
    return f"{round(value, 2) + 0.0:g}"


def _side(gripper: int) -> str:
    return f"{('right', 'left')[gripper]} gripper" if gripper < 2 else f"gripper {gripper}"
