"""Files of targets, read whole and checked before anything moves.

CSV: a header `time` and names of joints, then a line for each moment; an empty field says nothing about that joint.
JSON lines: `{"time": 0.0, "positions": {"joint": 0.1}}` a line. Times are in seconds and never go back; positions in
rad or m. The names `gripper_right` and `gripper_left` are how far each gripper is closed, 0 to 1. A ROS bag is read by
`bags.py`.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cellwright.clients.operators.robot import GRIPPER_COMMAND, JOINT_COMMAND
from cellwright.config.parsing.problems import Place, Problem
from cellwright.util.atomic_file import open_to_read
from cellwright.util.errors import DescriptionError, UsageError

GRIPPERS = ("gripper_right", "gripper_left")
"""Names that stand for the grippers, in their order."""

LARGEST = 1 << 28
"""A larger file is not read [bytes]."""

_MOST_PROBLEMS = 10


@dataclass(frozen=True, slots=True)
class Moment:
    """What is to be said at a time [s] on a topic: values by name."""

    time: float
    topic: str
    values: Mapping[str, float]


@dataclass(frozen=True)
class Targets:
    """The targets of a file, in order of time.

    Attributes:
        path: the file.
        moments: at least one.
    """

    path: Path
    moments: tuple[Moment, ...]

    @property
    def duration(self) -> float:
        """From the first moment to the last [s]."""
        return self.moments[-1].time - self.moments[0].time

    @property
    def first(self) -> dict[str, float]:
        """The first position that is said of each joint [rad; m]."""
        found: dict[str, float] = {}
        for moment in self.moments:
            if moment.topic != GRIPPER_COMMAND:
                for name, value in moment.values.items():
                    found.setdefault(name, value)
        return found

    @property
    def reach(self) -> dict[str, tuple[float, float]]:
        """The lowest and the highest position of each joint [rad; m]."""
        found: dict[str, tuple[float, float]] = {}
        for moment in self.moments:
            if moment.topic != GRIPPER_COMMAND:
                for name, value in moment.values.items():
                    low, high = found.get(name, (value, value))
                    found[name] = (min(low, value), max(high, value))
        return found


def read_targets(path: Path) -> Targets:
    """The targets in a CSV file or a file of JSON lines.

    Raises:
        UsageError: there is no such file, or it is of no kind that can be read.
        DescriptionError: something in it is wrong; each problem reads `path:line: what is wrong`.
    """
    readers = {".csv": _csv, ".jsonl": _json_lines}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise UsageError(f"{path}: give a file that ends in {', '.join(readers)} or .bag, or the folder of a ROS 2 bag")
    text = _text(path)
    problems: list[Problem] = []
    moments: list[Moment] = []
    last = -math.inf
    for line, found in reader(text):
        problem = found if isinstance(found, str) else _check(found, last)
        if problem:
            problems.append(Problem(Place(0, str(path), line), "", problem))
            if len(problems) == _MOST_PROBLEMS:
                break
        elif isinstance(found, Moment):
            last = found.time
            moments += _split(found)
    if not problems and not moments:
        problems.append(Problem(Place(0, str(path), 0), "", "there are no targets in it"))
    if problems:
        raise DescriptionError(problems)
    return Targets(path, tuple(moments))


def _text(path: Path) -> str:
    try:
        with open_to_read(path) as stream:
            content = stream.read(LARGEST + 1)
        if len(content) > LARGEST:
            raise UsageError(f"{path}: is larger than {LARGEST >> 20} MiB")
        return content.decode("utf-8-sig")
    except OSError as error:
        raise UsageError(f"{path}: cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError as error:
        raise UsageError(f"{path}: is not text in UTF-8: {error.reason} at byte {error.start}") from None


def _csv(text: str) -> Iterator[tuple[int, Moment | str]]:
    """Moments and problems with their line."""
    lines = csv.reader(io.StringIO(text, newline=""))
    try:
        head = [name.strip() for name in next(lines, [])]
        problem = _check_head(head)
        if problem:
            yield 1, problem
            return
        for row in lines:
            if row and any(field.strip() for field in row):
                yield lines.line_num, _row(head, row)
    except csv.Error as error:
        yield lines.line_num, str(error)


def _check_head(head: list[str]) -> str:
    if head[:1] != ["time"]:
        return "the first line must be `time` and names of joints, with commas between"
    names = head[1:]
    if not names or not all(names):
        return "the first line must name a joint for each column"
    twice = sorted({name for name in names if names.count(name) > 1})
    return f"named twice: {', '.join(twice)}" if twice else ""


def _row(head: list[str], row: list[str]) -> Moment | str:
    if len(row) != len(head):
        return f"{len(row)} fields, and the first line has {len(head)}"
    values: dict[str, float] = {}
    for name, field in zip(head, row, strict=True):
        if name != "time" and not field.strip():
            continue
        try:
            values[name] = float(field)
        except ValueError:
            return f"{name}: {field.strip()!r:.40} is no number"
    return Moment(values.pop("time"), JOINT_COMMAND, values)


def _json_lines(text: str) -> Iterator[tuple[int, Moment | str]]:
    for number, line in enumerate(text.split("\n"), start=1):
        if line.strip():
            try:
                yield number, _entry(json.loads(line))
            except (ValueError, RecursionError) as error:
                yield number, f"is no JSON: {getattr(error, 'msg', 'a number is too long, or it is nested too deeply')}"


def _entry(entry: Any) -> Moment | str:
    if not isinstance(entry, dict) or not {"time", "positions"} <= entry.keys():
        return 'must be an object with "time" and "positions"'
    time, positions = entry["time"], entry["positions"]
    if not _is_number(time):
        return f"time: {time!r:.40} is no number"
    if not isinstance(positions, dict):
        return "positions: must be an object with a number for each joint"
    for name, value in positions.items():
        if not _is_number(value):
            return f"positions: {name}: {value!r:.40} is no number"
    return Moment(float(time), JOINT_COMMAND, {name: float(value) for name, value in positions.items()})


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= 1e300


def _check(moment: Moment, last: float) -> str:
    if not math.isfinite(moment.time):
        return f"time: {moment.time} is not finite"
    if moment.time < last:
        return f"time: {moment.time:g} comes after {last:g}; time must not go back"
    for name, value in moment.values.items():
        if not math.isfinite(value):
            return f"{name}: {value} is not finite"
        if name in GRIPPERS and not 0.0 <= value <= 1.0:
            return f"{name}: {value:g} is not from 0 (open) to 1 (closed)"
    if GRIPPERS[1] in moment.values and GRIPPERS[0] not in moment.values:
        return f"{GRIPPERS[1]}: grippers are told in their order, so {GRIPPERS[0]} has to be said as well"
    return ""


def _split(moment: Moment) -> Iterable[Moment]:
    """A moment for joints and one for grippers, each where there is something to say."""
    joints = {name: value for name, value in moment.values.items() if name not in GRIPPERS}
    grippers = {name: moment.values[name] for name in GRIPPERS if name in moment.values}
    if joints:
        yield Moment(moment.time, JOINT_COMMAND, joints)
    if grippers:
        yield Moment(moment.time, GRIPPER_COMMAND, grippers)
