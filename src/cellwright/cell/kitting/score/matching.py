"""Judging a tray: which object stands for which part of a kit, and how well it lies."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

from cellwright.cell.kitting.score.kit_score import ExtraObject, ExtraReason, Fit, KitScore, PartFinding, Verdict
from cellwright.cell.kitting.tray import TrayContents, TrayObject
from cellwright.config.trial.trial import Kit, KitObject
from cellwright.util.pose import normalized, rpy_from_quaternion

MAX_DISTANCE = 0.03
"""How far from its place a part may lie [m]."""
MIN_QUATERNION_DOT = 0.95
"""How small |q1.q2| may be: 0.95 is a turn of 36 degrees about any axis."""
MAX_YAW_DIFFERENCE = 0.1
"""How far a part may be turned on the tray [rad]."""


def score_kit(kit: Kit, contents: TrayContents) -> KitScore:
    """Judge what lies on a tray as a kit, by the rules of the 2017 competition.

    Faulty objects never count. The others are taken in the order of the report, and each fills the first open place of
    its type in which it lies well. Objects that are left stand for the places of their type that are still open, the
    closest pair first: they earn the points for presence, and tell what was wrong with their pose.
    """
    matching = _Matching(kit)
    good = [index for index, each in enumerate(contents) if not each.is_faulty]
    faulty = [index for index, each in enumerate(contents) if each.is_faulty]
    unused = matching.place(good, contents)
    surplus = matching.pair_up(unused, contents)
    matching.pair_up(faulty, contents)  # a faulty part fills no place, but is worth naming where one is open
    ordered_types = {goal.type for goal in kit.objects}
    extras = tuple(_extra(contents[index], ordered_types) for index in sorted(surplus + faulty))
    return KitScore(kit.kit_type, is_submitted=True, parts=matching.findings(), extras=extras)


def compare(goal: KitObject, found: TrayObject) -> Fit:
    """How an object lies with respect to an ordered part."""
    gx, gy, _ = goal.pose.position
    fx, fy, _ = found.tray_T_object.position
    goal_q, found_q = goal.pose.quaternion, found.tray_T_object.quaternion
    dot = abs(sum(a * b for a, b in zip(goal_q, found_q, strict=True)))
    turn = abs(rpy_from_quaternion(normalized(goal_q))[2] - rpy_from_quaternion(normalized(found_q))[2])
    return Fit(found.name, math.hypot(gx - fx, gy - fy), dot, min(turn, abs(turn - 2 * math.pi)))


def judge(fit: Fit) -> Verdict:
    """What a good part that lies like this is worth to its place."""
    if not fit.distance <= MAX_DISTANCE:
        return Verdict.TOO_FAR
    if not fit.quaternion_dot >= MIN_QUATERNION_DOT:
        return Verdict.TILTED
    return Verdict.PLACED if fit.yaw_difference <= MAX_YAW_DIFFERENCE else Verdict.TURNED


def _extra(found: TrayObject, ordered_types: Collection[str]) -> ExtraObject:
    if found.is_faulty:
        return ExtraObject(found.name, found.type, ExtraReason.FAULTY)
    reason = ExtraReason.SURPLUS if found.type in ordered_types else ExtraReason.WRONG_TYPE
    return ExtraObject(found.name, found.type, reason)


class _Matching:
    """The places of one kit while they are being filled; objects are told apart by their number on the tray."""

    def __init__(self, kit: Kit) -> None:
        self._goals = kit.objects
        self._found: dict[int, tuple[Verdict, Fit]] = {}

    def place(self, indices: Sequence[int], contents: TrayContents) -> list[int]:
        """Let objects fill the places in which they lie well; the objects that fill none."""
        unused = []
        for index in indices:
            for goal in self._open(contents[index].type):
                fit = compare(self._goals[goal], contents[index])
                if judge(fit) is Verdict.PLACED:
                    self._found[goal] = (Verdict.PLACED, fit)
                    break
            else:
                unused.append(index)
        return unused

    def pair_up(self, indices: Sequence[int], contents: TrayContents) -> list[int]:
        """Let objects stand for places that are still open, the closest pair first; the objects that stand for none."""
        pairs = [
            (fit.distance, goal, index, fit)
            for index in indices
            for goal in self._open(contents[index].type)
            for fit in [compare(self._goals[goal], contents[index])]
        ]
        used: set[int] = set()
        for _distance, goal, index, fit in sorted(pairs, key=lambda pair: pair[:3]):
            if goal not in self._found and index not in used:
                used.add(index)
                self._found[goal] = (Verdict.FAULTY if contents[index].is_faulty else judge(fit), fit)
        return [index for index in indices if index not in used]

    def findings(self) -> tuple[PartFinding, ...]:
        return tuple(
            PartFinding(goal.type, goal.pose, *self._found.get(number, (Verdict.MISSING,)))
            for number, goal in enumerate(self._goals)
        )

    def _open(self, part_type: str) -> list[int]:
        return [n for n, goal in enumerate(self._goals) if goal.type == part_type and n not in self._found]
