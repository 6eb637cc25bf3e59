"""Target files: reading, checking and playing them, and recording new ones.

CSV: a header `time` and names of joints, then a line per sample; an empty field leaves that joint out.
JSON lines: `{"time": 0.0, "positions": {"joint": 0.1}}` a line. Times are in seconds and never go back; positions in
rad or m. The names `gripper_right` and `gripper_left` are the closed shares of the grippers, 0 to 1. `bags.py` reads
ROS bags.
"""

import csv
import io
import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cellwright.clients.operators.robot import (
    GRIPPER_COMMAND,
    JOINT_COMMAND,
    JOINT_STATES,
    JointLimits,
    MoveGrippers,
    MoveJoints,
    OperatedRobot,
)
from cellwright.config.parsing.tree import Place, Problem
from cellwright.middleware.messages.conversions import nanoseconds
from cellwright.util.errors import CellwrightError, DescriptionError, RunEndedError, UsageError
from cellwright.util.files import LineFile, open_to_read

GRIPPERS = ("gripper_right", "gripper_left")
"""Names that stand for the grippers, in their order."""

MAX_FILE_SIZE = 1 << 28
"""Size limit of a file [bytes]."""

_MAX_PROBLEMS = 10
APPROACH_SPEED = 0.5
"""Peak speed of the slow motion to the first targets [rad/s; m/s]."""
APPROACH_RATE = 100.0
"""Rate of commands in that motion [Hz]."""
_APPROACH_TOLERANCE = 0.05  # [rad; m] from the first targets at which playback may begin
_APPROACH_TIMEOUT = 2.0  # [s] to get there after the last command
_MIN_APPROACH_TIME = 0.5  # [s]


@dataclass(frozen=True, slots=True)
class TargetSample:
    """Values by name to publish on a topic at a time [s]."""

    time: float
    topic: str
    values: Mapping[str, float]


@dataclass(frozen=True)
class Targets:
    """The targets of a file, in order of time; there is at least one sample."""

    path: Path
    samples: tuple[TargetSample, ...]

    @property
    def duration(self) -> float:
        """Time from the first sample to the last [s]."""
        return self.samples[-1].time - self.samples[0].time

    @property
    def positions(self) -> dict[str, list[float]]:
        """The positions of each joint [rad; m], in order of time."""
        found: dict[str, list[float]] = {}
        for sample in self.samples:
            if sample.topic != GRIPPER_COMMAND:
                for name, value in sample.values.items():
                    found.setdefault(name, []).append(value)
        return found

    @property
    def first(self) -> dict[str, float]:
        """First target position of each joint [rad; m]."""
        return {name: values[0] for name, values in self.positions.items()}


def read_targets(path: Path) -> Targets:
    """Return the targets in a CSV file or a file of JSON lines.

    Raises:
        UsageError: there is no such file, or its format is unknown.
        DescriptionError: its content is wrong; each problem reads `path:line: what is wrong`.
    """
    readers = {".csv": _csv_samples, ".jsonl": _json_samples}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise UsageError(f"{path}: give a file that ends in {', '.join(readers)} or .bag, or the folder of a ROS 2 bag")
    text = _text(path)
    problems: list[Problem] = []
    samples: list[TargetSample] = []
    last = -math.inf
    for line, found in reader(text):
        problem = found if isinstance(found, str) else _check_sample(found, last)
        if problem:
            problems.append(Problem(Place(0, str(path), line), "", problem))
            if len(problems) == _MAX_PROBLEMS:
                break
        elif isinstance(found, TargetSample):
            last = found.time
            samples += _split(found)
    if not problems and not samples:
        problems.append(Problem(Place(0, str(path), 0), "", "it holds no targets"))
    if problems:
        raise DescriptionError(problems)
    return Targets(path, tuple(samples))


def _text(path: Path) -> str:
    try:
        with open_to_read(path) as stream:
            content = stream.read(MAX_FILE_SIZE + 1)
        if len(content) > MAX_FILE_SIZE:
            raise UsageError(f"{path}: must be at most {MAX_FILE_SIZE >> 20} MiB")
        return content.decode("utf-8-sig")
    except OSError as error:
        raise UsageError(f"{path}: cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError as error:
        raise UsageError(f"{path}: is not text in UTF-8: {error.reason} at byte {error.start}") from None


def _csv_samples(text: str) -> Iterator[tuple[int, TargetSample | str]]:
    """Yield samples and problems with their lines."""
    lines = csv.reader(io.StringIO(text, newline=""))
    try:
        head = [name.strip() for name in next(lines, [])]
        problem = _check_head(head)
        if problem:
            yield 1, problem
            return
        for row in lines:
            if row and any(field.strip() for field in row):
                yield lines.line_num, _csv_sample(head, row)
    except csv.Error as error:
        yield lines.line_num, str(error)


def _check_head(head: list[str]) -> str:
    if head[:1] != ["time"]:
        return "the first line must be `time` and joint names, separated by commas"
    names = head[1:]
    if not names or not all(names):
        return "the first line must name a joint for each column"
    twice = sorted({name for name in names if names.count(name) > 1})
    return f"named twice: {', '.join(twice)}" if twice else ""


def _csv_sample(head: list[str], row: list[str]) -> TargetSample | str:
    if len(row) != len(head):
        return f"needs {len(head)} fields as in the first line (got {len(row)})"
    values: dict[str, float] = {}
    for name, field in zip(head, row, strict=True):
        if name != "time" and not field.strip():
            continue
        try:
            values[name] = float(field)
        except ValueError:
            return f"{name}: must be a number (got {field.strip()!r:.40})"
    return TargetSample(values.pop("time"), JOINT_COMMAND, values)


def _json_samples(text: str) -> Iterator[tuple[int, TargetSample | str]]:
    for number, line in enumerate(text.split("\n"), start=1):
        if line.strip():
            try:
                yield number, _json_sample(json.loads(line))
            except (ValueError, RecursionError) as error:
                yield (
                    number,
                    f"is not JSON: {getattr(error, 'msg', 'a number is too long, or it is nested too deeply')}",
                )


def _json_sample(entry: Any) -> TargetSample | str:
    if not isinstance(entry, dict) or not {"time", "positions"} <= entry.keys():
        return 'must be an object with "time" and "positions"'
    time, positions = entry["time"], entry["positions"]
    if not _is_number(time):
        return f"time: must be a number (got {time!r:.40})"
    if not isinstance(positions, dict):
        return "positions: must be an object with a number for each joint"
    for name, value in positions.items():
        if not _is_number(value):
            return f"positions: {name}: must be a number (got {value!r:.40})"
    return TargetSample(float(time), JOINT_COMMAND, {name: float(value) for name, value in positions.items()})


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= 1e300


def _check_sample(sample: TargetSample, last: float) -> str:
    if not math.isfinite(sample.time):
        return f"time: must be finite (got {sample.time})"
    if sample.time < last:
        return f"time: must not decrease (got {sample.time:g} after {last:g})"
    for name, value in sample.values.items():
        if not math.isfinite(value):
            return f"{name}: must be finite (got {value})"
        if name in GRIPPERS and not 0.0 <= value <= 1.0:
            return f"{name}: must be from 0 (open) to 1 (closed) (got {value:g})"
    if GRIPPERS[1] in sample.values and GRIPPERS[0] not in sample.values:
        return f"{GRIPPERS[1]}: needs {GRIPPERS[0]} as well: grippers are addressed by order"
    return ""


def _split(sample: TargetSample) -> Iterable[TargetSample]:
    """Yield a sample for joints and one for grippers, each if it has values."""
    joints = {name: value for name, value in sample.values.items() if name not in GRIPPERS}
    grippers = {name: sample.values[name] for name in GRIPPERS if name in sample.values}
    if joints:
        yield TargetSample(sample.time, JOINT_COMMAND, joints)
    if grippers:
        yield TargetSample(sample.time, GRIPPER_COMMAND, grippers)


def check(robot: OperatedRobot, targets: Targets, limits: JointLimits) -> None:
    """Refuse targets that are not for this robot.

    Raises:
        UnknownNameError: they name a joint that it has not.
        UsageError: they would leave its limits, it has fewer grippers, it takes no commands, or it does not publish
            the position of a joint.
    """
    positions = targets.positions
    robot.check_names(positions)
    for name in positions:
        robot.position(name)
    for name, values in positions.items():
        limits.check(name, min(values), max(values), str(targets.path))
    grippers = max((len(each.values) for each in targets.samples if each.topic == GRIPPER_COMMAND), default=0)
    if robot.grippers and grippers > len(robot.grippers):
        raise UsageError(f"{targets.path}: has targets for {grippers} grippers (the robot has {len(robot.grippers)})")
    robot.check_ready()


def approach(
    robot: OperatedRobot,
    first: Mapping[str, float],
    duration: float | None = None,
    *,
    on_progress: Callable[[float], None] = lambda _time: None,
) -> None:
    """Move joints smoothly from their present positions to others [rad; m].

    The motion takes `duration` [s], by default the time that the farthest joint needs at `APPROACH_SPEED`. After each
    command `on_progress` takes the time so far [s].

    Raises:
        UsageError: a joint did not get there.
    """
    session = robot.session
    start = {name: robot.position(name) for name in first}
    farthest = max((abs(first[name] - start[name]) for name in first), default=0.0)
    if duration is None:
        # at its middle a cosine is pi/2 as fast
        duration = max(_MIN_APPROACH_TIME, farthest * math.pi / 2 / APPROACH_SPEED)
    begun, beat = session.time, session.rate(APPROACH_RATE)
    part = 0.0
    while part < 1.0 and first:
        part = 1.0 if duration <= 0.0 else min(1.0, (session.time - begun) / duration)
        blend = 0.5 - 0.5 * math.cos(math.pi * part)
        robot.send(MoveJoints({name: start[name] + blend * (first[name] - start[name]) for name in first}))
        on_progress(session.time - begun)
        beat.sleep()

    def missing() -> list[str]:
        now = robot.positions
        return [name for name in first if abs(now.get(name, math.inf) - first[name]) > _APPROACH_TOLERANCE]

    if not session.wait_until(lambda: not missing(), _APPROACH_TIMEOUT):
        name = missing()[0]
        reason = robot.why_not() or "something blocks it"
        raise UsageError(
            f"{name} did not reach the first target: it is at {robot.position(name):.4g}, and "
            f"the target is {first[name]:.4g}; {reason}"
        )


def play(
    robot: OperatedRobot,
    targets: Targets,
    *,
    speed: float = 1.0,
    on_progress: Callable[[float], None] = lambda _time: None,
) -> None:
    """Send all targets at their times. Late targets are not rushed: of a topic only the newest is sent.

    `speed` seconds of the file pass in a second; after each sample `on_progress` takes the time in the file [s].
    """
    session = robot.session
    begun, origin = session.time, targets.samples[0].time
    samples = targets.samples
    number = 0
    while number < len(samples):
        session.sleep(max(0.0, begun + (samples[number].time - origin) / speed - session.time))
        now = origin + (session.time - begun) * speed
        # Only a sample of the same joints replaces another: those of other joints of the topic add to it.
        due: dict[tuple[str, frozenset[str]], TargetSample] = {}
        while number < len(samples) and (samples[number].time <= now or not due):
            key = (samples[number].topic, frozenset(samples[number].values))
            # removed first, so that the newest is also the last in order
            due.pop(key, None)
            due[key] = samples[number]
            number += 1
        for sample in due.values():
            values, is_gripper = sample.values, sample.topic == GRIPPER_COMMAND
            robot.send(MoveGrippers(tuple(values.values())) if is_gripper else MoveJoints(values, sample.topic))
        on_progress(samples[number - 1].time - origin)


class JointRecorder:
    """Records the joint states of a topic, as they come, to a file that ends in .csv or .jsonl.

    `report` takes a line about a file that can no longer be written.

    Raises:
        UsageError: the file cannot be written.
    """

    def __init__(
        self,
        robot: OperatedRobot,
        path: Path,
        *,
        topic: str = JOINT_STATES,
        report: Callable[[str], None] = lambda _line: None,
    ) -> None:
        self._session = robot.session
        self._joints = robot.joints
        self._is_csv = path.suffix.lower() == ".csv"
        try:
            self._file = LineFile(path, report=report)
        except OSError as error:
            raise UsageError(f"{path}: cannot be written: {error.strerror or error}") from None
        if self._is_csv:
            self._file.write(_csv_line(["time", *self._joints]))
        self._begun: float | None = None
        self.lines = 0
        """Number of written samples."""
        self.time = 0.0
        """Time of the newest sample, from the first on [s]."""
        try:
            self._unsubscribe = self._session.subscribe(topic, self._take)
        except BaseException:
            self._file.close()
            raise

    @property
    def is_writing(self) -> bool:
        """True while samples go to the file."""
        return self._file.is_writing

    def close(self) -> None:
        """Stop recording, and close the file."""
        with suppress(CellwrightError, RunEndedError):  # the node may be gone
            self._unsubscribe()
        self._file.close()

    def _take(self, message: Any) -> None:
        # programs that stamp nothing leave 0; a clock that goes back must not make times decrease
        stamp = nanoseconds(message.header.stamp) / 1e9 or self._session.time
        if self._begun is None:
            self._begun = stamp
        time = max(self.time, stamp - self._begun)
        known = dict(zip(message.name, map(float, message.position), strict=False))
        values = {name: known[name] for name in self._joints if math.isfinite(known.get(name, math.nan))}
        if not values:
            return
        if self._is_csv:
            fields = (f"{values[name]:.9g}" if name in values else "" for name in self._joints)
            self._file.write(_csv_line([f"{time:.6f}", *fields]))
        else:
            self._file.write(json.dumps({"time": round(time, 6), "positions": values}))
        self.lines += 1
        self.time = time


def _csv_line(fields: list[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="").writerow(fields)
    return text.getvalue()
