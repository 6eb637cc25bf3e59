"""Privileged state: what a task is about, relative to what holds parts; a policy with cameras alone lacks it."""

from __future__ import annotations

import heapq
import math
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from cellwright.cell.cell import Cell
from cellwright.cell.devices.grippers import tool_points
from cellwright.cell.kitting.inventory import trimmed_name
from cellwright.cell.model.build import WorldPart
from cellwright.config.trial.task import Discarded, Held, KitBuilt, LinkAt, OnTray, Scored, Task, Turned
from cellwright.config.trial.trial import Trial
from cellwright.util.pose import Pose

FAULTY: Final = "faulty"
"""Name of the slot of faulty parts, whatever their types."""
_POSE: Final = ("x", "y", "z", "qw", "qx", "qy", "qz")
_PART: Final = ("present", *_POSE)


@dataclass(frozen=True, slots=True)
class _Goal:
    """Place that something belongs to: on a tray, by the name of its link."""

    name: str
    link: str
    tray_T_goal: Pose


class PrivilegedState:
    """Privileged state of a task: numbers with names, the same in each run of a trial.

    Relative poses are those in the frame of a holder: an arm's cup or the middle between its pads, with the orientation
    of its link, or a robot's hand. They are position [m] and quaternion (w not negative). Of each type that the task is
    about, as many parts are given as it needs, the nearest first; one that is not there has zeros, and `present` 0.

    Args:
        trial: a trial with a task.
        task: its task.

    Attributes:
        names: names of the numbers. For each holder these are `holds` (0 or 1), its own pose in the world, its parts
            and its goals on trays. Then comes the speed of each belt [m/s]. Last, for each link with a goal, is the way
            there in the world [m].

    Example:
        >>> from cellwright import load_trial
        >>> trial = load_trial("pick_from_bin")
        >>> PrivilegedState(trial, trial.task).names[:4]
        ('holds', 'tool.x', 'tool.y', 'tool.z')
    """

    def __init__(self, trial: Trial, task: Task) -> None:
        self._wanted = _wanted(trial, task)
        self._goals = tuple(_goals(trial, task))
        self._links = tuple(each for each in task.success if isinstance(each, LinkAt))
        self._belts = tuple(each.name for each in trial.layout.belts)
        arms = [arm.name for arm in trial.arms if arm.tool.kind != "none"]
        self._holders = (*arms, *(hand.name for robot in trial.layout.robots for hand in robot.hands))
        self.names = tuple(self._name())

    def read(self, cell: Cell) -> list[float]:
        """Return the numbers of now, in the order of `names`."""
        simulation, parts = cell.simulation, cell.parts
        simulation.refresh()
        in_play = [each for each in parts.all if each.name in parts.in_play]
        candidates = {
            kind: [(each, parts.pose(each)) for each in in_play if _is(each, kind, cell)] for kind in self._wanted
        }
        goals = [_body_pose(cell, simulation.model.body(each.link).id) @ each.tray_T_goal for each in self._goals]
        active = simulation.data.eq_active
        found: list[float] = []
        for name, world_T_tool in zip(self._holders, self._tools(cell), strict=True):
            tool_T_world = world_T_tool.inverse()
            found.append(float(any(active[each.grips[name]] for each in in_play)))
            found += _numbers(world_T_tool)
            for kind, count in self._wanted.items():
                found += _nearest(candidates[kind], count, world_T_tool, tool_T_world)
            for goal in goals:
                found += _numbers(tool_T_world @ goal)
        found += [cell.conveyors[name].speed for name in self._belts]
        for each in self._links:
            place = simulation.data.xpos[simulation.model.body(f"{each.robot}/{each.link}").id].tolist()
            found += [there - here for there, here in zip(each.at, place, strict=True)]
        return found

    def _name(self) -> Iterator[str]:
        for holder in self._holders:
            prefix = f"{holder}:" if len(self._holders) > 1 else ""
            yield f"{prefix}holds"
            yield from (f"{prefix}tool.{each}" for each in _POSE)
            for kind, count in self._wanted.items():
                for number in range(count):
                    slot = f"{kind}{number + 1}" if count > 1 else kind
                    yield from (f"{prefix}{slot}.{each}" for each in _PART)
            yield from (f"{prefix}{goal.name}.{each}" for goal in self._goals for each in _POSE)
        yield from (f"{name}.speed" for name in self._belts)
        yield from (f"{each.robot}/{each.link}.to_{axis}" for each in self._links for axis in "xyz")

    def _tools(self, cell: Cell) -> Iterator[Pose]:
        """Yield the frames of the holders in the world."""
        model = cell.simulation.model
        for body, offset in tool_points(model, cell.grippers.values(), lambda each: each):
            yield _body_pose(cell, body) @ Pose(tuple(offset))
        for robot in cell.trial.layout.robots:
            for hand in robot.hands:
                yield _body_pose(cell, int(model.geom(hand.name).bodyid[0]))


def _wanted(trial: Trial, task: Task) -> dict[str, int]:
    """Return how many parts of each type the task is about."""
    found: Counter[str] = Counter()
    for each in task.success:
        match each:
            case Held() | Turned():
                found |= Counter({each.part: 1})
            case KitBuilt() | Scored():
                for kit in (kit for order in trial.orders for kit in order.kits):
                    found |= Counter(part.type for part in kit.objects)
            case Discarded():
                found |= Counter({FAULTY: 1})
    placed = Counter(each.part for each in task.success if isinstance(each, OnTray))
    held = Counter([task.start.holding] if task.start.holding else [])
    return dict(sorted((found | placed | held).items()))


def _goals(trial: Trial, task: Task) -> Iterator[_Goal]:
    """Yield the places on trays that the task names, or that its kits have."""
    links = {each.name: each.tray_link for each in trial.stations}
    for each in task.success:
        match each:
            case OnTray():
                turn = Pose.from_rpy((*(each.at or (0.0, 0.0)), 0.0), (0.0, 0.0, each.yaw or 0.0))
                yield _Goal(f"{each.tray}/{each.part}", links[each.tray], turn)
            case Discarded():
                yield _Goal(each.tray, links[each.tray], Pose())
            case KitBuilt() | Scored():
                for kit in (kit for order in trial.orders for kit in order.kits):
                    # a kit that any tray may have belongs to the first one
                    tray = kit.tray or next(iter(links))
                    for number, part in enumerate(kit.objects, 1):
                        yield _Goal(f"{kit.kit_type}/{part.type}{number}", links[tray], part.pose)


def _is(part: WorldPart, kind: str, cell: Cell) -> bool:
    return trimmed_name(part.name) in cell.trial.faulty_parts if kind == FAULTY else part.type == kind


def _nearest(
    candidates: Iterable[tuple[WorldPart, Pose]], count: int, world_T_tool: Pose, tool_T_world: Pose
) -> list[float]:
    """Return the nearest parts, each with `present`; zeros where there are fewer."""
    at = world_T_tool.position
    nearest = heapq.nsmallest(count, candidates, key=lambda each: (math.dist(each[1].position, at), each[0].name))
    found: list[float] = []
    for _, pose in nearest:
        found += (1.0, *_numbers(tool_T_world @ pose))
    return found + [0.0] * ((count - len(nearest)) * len(_PART))


def _numbers(pose: Pose) -> tuple[float, ...]:
    """Return a pose as numbers: a turn has two quaternions, and this is the one with w not negative."""
    sign = -1.0 if pose.quaternion[0] < 0.0 else 1.0
    return (*pose.position, *(sign * value for value in pose.quaternion))


def _body_pose(cell: Cell, body: int) -> Pose:
    data = cell.simulation.data
    return Pose(tuple(data.xpos[body].tolist()), tuple(data.xquat[body].tolist()))
