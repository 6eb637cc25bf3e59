"""Conditions of a task on the state of a cell: whether each holds, and how near it is, from 0 to 1.

A potential grows with the work done and is 1 when the condition holds. Distances d [m] enter as `near(d)`, which is 1
at 0 and 0.24 at 0.2 m.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from cellwright.cell.kitting.kit_score import score_kit
from cellwright.cell.model.build import WorldPart
from cellwright.cell.tasks.view import TaskView
from cellwright.config.trial.task import Condition, Discarded, Held, KitBuilt, LinkAt, OnTray, Scored, Turned
from cellwright.util.pose import Pose, rpy_from_quaternion

NEAR = 5.0
"""Slope of `near` [1/m]."""
REACHED = 0.25
"""Share of a potential for a part that is reached and held, if more is to be done with it."""
CARRIED = 0.75
"""Share of a potential for a part that is held at its place, but does not lie there yet."""
_POINTS = 1e-6
"""Points that rounding may take away."""


def near(distance: float) -> float:
    """Return how near a distance [m] is, from 0 (far) to 1.

    Example:
        >>> near(0.0), round(near(0.2), 2)
        (1.0, 0.24)
    """
    return 1.0 - math.tanh(NEAR * max(0.0, distance))


def potential(condition: Condition, view: TaskView) -> float:
    """Return how near a condition is, from 0 to 1; it is 1 exactly if the condition holds.

    Args:
        condition: the condition.
        view: the cell now.
    """
    if holds(condition, view):
        return 1.0
    return min(_nearness(condition, view), math.nextafter(1.0, 0.0))


def holds(condition: Condition, view: TaskView) -> bool:
    """Return whether a condition holds now.

    Args:
        condition: the condition.
        view: the cell now.
    """
    match condition:
        case Held():
            return any(_rise(part, view) >= condition.lifted for part in _held(condition, view))
        case OnTray():
            return any(
                each.type == condition.part and _is_placed(condition, each.tray_T_object)
                for each in view.lying(condition.tray)
            )
        case KitBuilt() | Scored():
            return any(points >= full - _POINTS for points, full in _points(condition, view))
        case Discarded():
            return not any(_is_kept(condition, view))
        case Turned():
            parts = filter(view.is_resting, view.of_type(condition.part))
            return any(_turn(part, view) >= math.pi - condition.tolerance for part in parts)
        case LinkAt():
            return math.dist(view.link(condition.robot, condition.link), condition.at) <= condition.tolerance


def _nearness(condition: Condition, view: TaskView) -> float:
    match condition:
        case Held():
            return _near_held(condition, view)
        case OnTray():
            return _near_on_tray(condition, view)
        case KitBuilt() | Scored():
            shares = (max(0.0, points) / goal for points, goal in _points(condition, view) if goal > 0.0)
            return max(shares, default=0.0)
        case Discarded():
            kept = [*_is_kept(condition, view)]
            return 1.0 - sum(kept) / max(1, len(kept))
        case Turned():
            return _near_turned(condition, view)
        case LinkAt():
            distance = math.dist(view.link(condition.robot, condition.link), condition.at)
            return near(distance - condition.tolerance)


def _held(condition: Held, view: TaskView) -> Iterator[WorldPart]:
    return (part for part in view.of_type(condition.part) if view.is_held(part, condition.by))


def _rise(part: WorldPart, view: TaskView) -> float:
    """Return the height of a part over its place at the start [m]."""
    return view.parts.pose(part).position[2] - view.start_of(part).position[2]


def _near_held(condition: Held, view: TaskView) -> float:
    """Half for reaching, half for lifting."""
    lifts = (min(1.0, max(0.0, _rise(part, view)) / condition.lifted) for part in _held(condition, view))
    lifted = max(lifts, default=None) if condition.lifted > 0.0 else None
    if lifted is not None:
        return 0.5 + 0.5 * lifted
    places = (view.parts.pose(part).position for part in view.of_type(condition.part))
    return max((0.5 * near(view.tool_distance(place, condition.by)) for place in places), default=0.0)


def _is_placed(condition: OnTray, tray_T_part: Pose) -> bool:
    x, y, _ = tray_T_part.position
    if condition.at is not None and math.dist((x, y), condition.at) > condition.tolerance:
        return False
    if condition.yaw is None:
        return True
    is_upright = tray_T_part.rotate((0.0, 0.0, 1.0))[2] >= math.cos(condition.turn_tolerance)
    turn = abs(math.remainder(rpy_from_quaternion(tray_T_part.quaternion)[2] - condition.yaw, 2 * math.pi))
    return is_upright and turn <= condition.turn_tolerance


def _near_on_tray(condition: OnTray, view: TaskView) -> float:
    """Up to `REACHED` for reaching, then up to `CARRIED` for carrying the part to its place."""
    goal = view.trays[condition.tray].world_T_tray.transform((*(condition.at or (0.0, 0.0)), 0.0))

    def share(part: WorldPart) -> float:
        place = view.parts.pose(part).position
        if view.is_held(part):
            return REACHED + (CARRIED - REACHED) * near(math.dist(place, goal))
        return REACHED * near(view.tool_distance(place))

    return max(map(share, view.of_type(condition.part)), default=0.0)


def _points(condition: KitBuilt | Scored, view: TaskView) -> Iterator[tuple[float, float]]:
    """Yield points and goal: of the score, or of each kit of the announced orders, on each tray that may have it."""
    if isinstance(condition, Scored):
        goal = view.attainable.total if condition.points is None else condition.points
        yield view.competition.score().total, goal
        return
    for kit in (kit for order in view.competition.announced for kit in order.kits):
        goal = view.attainable.kit(kit.kit_type).total if condition.points is None else condition.points
        for tray in view.trays if kit.tray is None else [kit.tray]:
            yield score_kit(kit, view.lying(tray)).total, goal


def _is_kept(condition: Discarded, view: TaskView) -> Iterator[bool]:
    """Yield for each faulty part in play whether it stands on the tray or is held."""
    standing = {each.name for each in view.standing(condition.tray)}
    for part in view.parts.all:
        if part.name in view.parts.in_play and view.is_faulty(part.name):
            yield part.name in standing or view.is_held(part)


def _turn(part: WorldPart, view: TaskView) -> float:
    """Return the angle between the z axis of a part now and at the start [rad]."""
    now, before = (pose.rotate((0.0, 0.0, 1.0)) for pose in (view.parts.pose(part), view.start_of(part)))
    return math.acos(max(-1.0, min(1.0, sum(a * b for a, b in zip(now, before, strict=True)))))


def _near_turned(condition: Turned, view: TaskView) -> float:
    """Up to `REACHED` for reaching, the rest with the angle."""

    def share(part: WorldPart) -> float:
        reached = 1.0 if view.is_held(part) else near(view.tool_distance(view.parts.pose(part).position))
        return REACHED * reached + (1.0 - REACHED) * _turn(part, view) / math.pi

    return max(map(share, view.of_type(condition.part)), default=0.0)
