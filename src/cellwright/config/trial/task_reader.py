"""Reader of the section `task` of a trial; everything that it names must be in the cell."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, get_args

from cellwright.config.layout.keys import ANGLE, PLACE, POINT
from cellwright.config.parsing import schema
from cellwright.config.parsing.quantities import quantity
from cellwright.config.parsing.reader import Keys, Read, Reader, choice, number
from cellwright.config.parsing.schema import Elsewhere, Schema
from cellwright.config.parsing.tree import Items, Table, YamlNode, shortened
from cellwright.config.robot.model import Limits
from cellwright.config.trial.task import (
    Condition,
    Discarded,
    Held,
    KitBuilt,
    LinkAt,
    OnTray,
    RewardKind,
    Scored,
    Task,
    TaskStart,
    Turned,
)
from cellwright.config.trial.task_values import read_joints, read_points, read_sentence, values_of
from cellwright.config.trial.trial import Trial
from cellwright.util.errors import suggestion

MAX_CONDITIONS = 20
"""Maximum number of mappings of conditions."""
_SMALL = quantity(0.0, 10.0, "m")
_ANGLE = quantity(0.0, math.pi, "rad")
_TOLERANCE = quantity(0.001, 1.0, "m")


HELD = Keys({"part": Reader.name}, {"lifted": _SMALL, "by": Reader.name}, strict="entry", texts="task-held")
ON_TRAY = Keys(
    {"part": Reader.name, "tray": Reader.name},
    {"at": PLACE, "yaw": ANGLE, "tolerance": _TOLERANCE, "turn_tolerance": _ANGLE},
    strict="entry",
    texts="task-on-tray",
)
DISCARDED = Keys({"tray": Reader.name}, strict="entry", texts="task-discarded")
TURNED = Keys({"part": Reader.name}, {"tolerance": _ANGLE}, strict="entry", texts="task-turned")
LINK_AT = Keys(
    {"robot": Reader.name, "link": Reader.name, "at": POINT},
    {"tolerance": _TOLERANCE},
    strict="entry",
    texts="task-link-at",
)
START = Keys(
    optional={"joints": read_joints, "jitter": number(0.0, 1.0, "rad or m"), "holding": Reader.name},
    strict="entry",
    texts="task-start",
)
"""Keys of `start`."""


CONDITIONS: Mapping[str, tuple[Read, Callable[..., Condition]]] = {
    "held": (values_of(HELD), Held),
    "on_tray": (values_of(ON_TRAY), OnTray),
    "kit": (read_points, KitBuilt),
    "score": (read_points, Scored),
    "discarded": (values_of(DISCARDED), Discarded),
    "turned": (values_of(TURNED), Turned),
    "link_at": (values_of(LINK_AT), LinkAt),
}
"""Reader and class of each condition."""
SUCCESS = Keys(
    optional={name: read for name, (read, _) in CONDITIONS.items()}, strict="condition", texts="task-success"
)
"""Keys of `success`."""


TASK = Keys(
    {"sentence": read_sentence, "success": Elsewhere(lambda: _success_schema())},
    {
        "start": Elsewhere(START.schema),
        "hold_for": quantity(0.0, 3600.0, "s"),
        "reward": choice(get_args(RewardKind)),
        "starts_competition": Reader.boolean,
    },
    strict="entry",
    texts="task",
)
"""Keys of the section `task`."""


@dataclass(frozen=True)
class ReadTask:
    """Task as read, with the place of what it names."""

    task: Task
    places: tuple[tuple[Condition, YamlNode], ...]
    start: Table | None


def read_task(node: YamlNode, reader: Reader) -> ReadTask | None:
    """Return the section `task`; None after an error."""
    table, errors = reader.table(node), reader.problems.error_count
    if table is None:
        return None
    values = TASK.read(table, reader)
    places = tuple(_success(table.get("success"), reader))
    begin = table.get("start")
    start = reader.table(begin) if begin is not None else None
    read = START.read(start, reader) if start is not None else {}
    if reader.problems.error_count > errors:
        return None
    return ReadTask(Task(success=tuple(each for each, _ in places), start=TaskStart(**read), **values), places, start)


def _success_schema() -> Schema:
    one = {**SUCCESS.schema(), "minProperties": 1}
    return {"anyOf": [one, schema.array(one, 1, MAX_CONDITIONS)]}


def _success(node: YamlNode | None, reader: Reader) -> Iterator[tuple[Condition, YamlNode]]:
    """Yield each condition with its place."""
    if node is None:
        return
    items = node.items if isinstance(node, Items) else [node]
    if not 1 <= len(items) <= MAX_CONDITIONS:
        message = f"must have 1 to {MAX_CONDITIONS} mappings of conditions (got {len(items)})"
        reader.problems.error(node, message)
        return
    for item in items:
        table = reader.table(item)
        if table is None:
            continue
        if not table.entries:
            reader.problems.error(item, f"must have a condition{suggestion('', CONDITIONS)}")
        for name, values in SUCCESS.read(table, reader).items():
            yield CONDITIONS[name][1](**values), table.entries[name].value


def check_task(read: ReadTask, trial: Trial, reader: Reader) -> None:
    """Report what the task names and the cell lacks.

    Args:
        read: the task as read.
        trial: the trial, whose cell is as its file describes it.
        reader: takes the errors.
    """
    check = _Check(trial, reader)
    for condition, place in read.places:
        check.condition(condition, place)
    if read.start is not None:
        check.start(read.task.start, read.start)


class _Check:
    """Names that a task may use, and the reports of all others."""

    def __init__(self, trial: Trial, reader: Reader) -> None:
        self._trial, self._reader = trial, reader
        self._lying = sorted({each.type for each in (*trial.bin_parts, *trial.extra_parts)})
        self._types = sorted({*self._lying, *(each.type for each in trial.belt_parts)})
        self._trays = [each.name for each in trial.stations]
        arms = [arm.name for arm in trial.arms if arm.tool.kind != "none"]
        self._holders = [*arms, *(hand.name for robot in trial.layout.robots for hand in robot.hands)]

    def condition(self, condition: Condition, place: YamlNode) -> None:
        """Check what a condition names."""
        match condition:
            case Held(part=part, by=by):
                self._known(part, self._types, "part of the type", place, "part")
                if not self._holders:
                    self._error(place, "nothing in the cell can hold a part; give it an arm with a tool, or hands")
                elif by is not None:
                    self._known(by, self._holders, "arm or hand", place, "by")
            case OnTray(part=part, tray=tray):
                self._known(part, self._types, "part of the type", place, "part")
                self._known(tray, self._trays, "AGV or tray", place, "tray")
            case KitBuilt() | Scored():
                if not self._trial.orders:
                    self._error(place, "the trial has no order; add the section orders")
            case Discarded(tray=tray):
                self._known(tray, self._trays, "AGV or tray", place, "tray")
                if not self._trial.faulty_parts:
                    self._error(place, "the trial has no faulty part; name one in the section faulty_parts")
            case Turned(part=part):
                self._known(part, self._types, "part of the type", place, "part")
            case LinkAt(robot=robot, link=link):
                robots = self._trial.robot_models
                if self._known(robot, robots, "robot", place, "robot"):
                    self._known(link, robots[robot].robot.links, "link", place, "link")

    def start(self, start: TaskStart, table: Table) -> None:
        """Check joints and the part that is held."""
        joints = self._trial.joints
        if "joints" in table.entries and not joints:
            self._error(table.entries["joints"], "the cell has no arm; leave it out")
        if "jitter" in table.entries and not (joints or self._trial.layout.robots):
            self._error(table.entries["jitter"], "the cell has no arm and no robot; leave it out")
        written = table.get("joints")
        if joints and isinstance(written, Table):
            for name, position in start.joints.items():
                self._joint(name, position, joints, written)
        if start.holding is not None:
            self._known(start.holding, self._lying, "part of the type in a bin", table, "holding")
            if [arm.tool.kind for arm in self._trial.arms] != ["vacuum"]:
                self._error(table.entries["holding"], "needs a cell with one arm, and a suction cup on it")

    def _joint(self, name: str, position: float, joints: Mapping[str, Limits], written: Table) -> None:
        if not self._known(name, joints, "arm joint", written, name):
            return
        limits = joints[name]
        if not limits.lower <= position <= limits.upper:
            bounds = f"{limits.lower:g} to {limits.upper:g}"
            self._error(written.entries[name], f"must be within the joint's limits of {bounds} (got {position:g})")

    def _known(self, name: str, known: Collection[str], thing: str, place: YamlNode, key: str) -> bool:
        if name in known:
            return True
        where = place.entries[key] if isinstance(place, Table) else place
        self._error(where, f"the cell has no {thing} {shortened(name)!r}{suggestion(name, known)}")
        return False

    def _error(self, where: Any, message: str) -> None:
        self._reader.problems.error(where, message)
