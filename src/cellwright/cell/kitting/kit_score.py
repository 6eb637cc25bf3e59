"""Score of a kit: matching of a tray with the ordered parts, and the finding behind every point.

A `KitScore` holds the findings for each ordered part and each unused object. Its points are computed from these
findings, so a score can never disagree with its explanation.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from cellwright.cell.kitting.inventory import TrayContents, TrayObject
from cellwright.config.trial.trial import Kit, KitObject
from cellwright.util.errors import did_you_mean
from cellwright.util.pose import Pose, normalized, rpy_from_quaternion

PRESENCE_POINTS = 1.0
"""Points for each ordered part that is on the tray."""
BONUS_POINTS = 1.0
"""Points for each ordered part, if the tray holds exactly the ordered parts."""
POSE_POINTS = 1.0
"""Points for each ordered part that lies in its place."""

MAX_DISTANCE = 0.03
"""Largest accepted distance of a part from its place [m]."""
MIN_QUATERNION_DOT = 0.95
"""Smallest accepted |q1.q2|; 0.95 is a turn of 36 degrees about any axis."""
MAX_YAW_DIFFERENCE = 0.1
"""Largest accepted yaw error of a part on the tray [rad]."""


class Verdict(StrEnum):
    """Result for an ordered part. It names the first failing check, in the order `TOO_FAR` to `TURNED`."""

    PLACED = "placed"
    """A part lies in its place: points for presence and pose."""
    TOO_FAR = "too far"
    """A part is present, but its place is empty: points for presence."""
    TILTED = "tilted"
    """A part lies in its place, but not with the ordered side up: points for presence."""
    TURNED = "turned"
    """A part lies in its place, the right way up, with a wrong yaw: points for presence."""
    FAULTY = "faulty"
    """Only a faulty part is present: no points."""
    MISSING = "missing"
    """No part is present: no points."""


class ExtraReason(StrEnum):
    """Reasons why an object on the tray was not used."""

    FAULTY = "faulty"
    WRONG_TYPE = "wrong type"
    """The kit has no part of this type."""
    SURPLUS = "surplus"
    """The kit has fewer parts of this type."""


class BonusVerdict(StrEnum):
    """Result for the bonus of a complete tray: earned, or the reason why not."""

    EARNED = "earned"
    PARTS_SHORT = "parts short"
    EXTRA_OBJECTS = "extra objects"


class RefusalReason(StrEnum):
    """Reasons for not scoring a submission."""

    UNKNOWN_KIT_TYPE = "unknown kit type"
    NOT_ANNOUNCED = "order not announced"
    ORDER_CLOSED = "order closed"
    OTHER_TRAY = "not its tray"


@dataclass(frozen=True, slots=True)
class Fit:
    """Comparison of an object on the tray with an ordered part.

    Attributes:
        object_name: full model name of the object.
        distance: between the two origins along the tray, without height [m].
        quaternion_dot: |q1.q2| of the two orientations, 1 when they are equal.
        yaw_difference: smallest angle between the two yaws, 0 to pi [rad].
    """

    object_name: str
    distance: float
    quaternion_dot: float
    yaw_difference: float


@dataclass(frozen=True, slots=True)
class PartFinding:
    """Finding for one ordered part.

    Attributes:
        tray_T_goal: ordered pose.
        fit: the matched object and its comparison; None if the part is missing.
    """

    type: str
    tray_T_goal: Pose
    verdict: Verdict
    fit: Fit | None = None

    @property
    def is_present(self) -> bool:
        """True if a good part of the type is matched."""
        return self.verdict not in (Verdict.MISSING, Verdict.FAULTY)

    @property
    def presence(self) -> float:
        """Points for presence."""
        return PRESENCE_POINTS if self.is_present else 0.0

    @property
    def pose(self) -> float:
        """Points for pose."""
        return POSE_POINTS if self.verdict is Verdict.PLACED else 0.0


@dataclass(frozen=True, slots=True)
class ExtraObject:
    """An object on the tray that is matched with no ordered part."""

    name: str
    type: str
    reason: ExtraReason


@dataclass(frozen=True, slots=True)
class Refusal:
    """A submission that earned nothing, because no order in progress asked for the kit.

    Attributes:
        order_id: the order that the kit belongs to; None if there is none.
        accepted: the kit types that would have been scored.
    """

    reason: RefusalReason
    kit_type: str
    order_id: str | None = None
    accepted: tuple[str, ...] = ()

    def sentence(self) -> str:
        """The refusal in one sentence, as a readable text."""
        accepted = ", ".join(self.accepted) or "none"
        match self.reason:
            case RefusalReason.UNKNOWN_KIT_TYPE:
                why = f"belongs to no order{did_you_mean(self.kit_type, self.accepted)}"
            case RefusalReason.NOT_ANNOUNCED:
                why = f"belongs to {self.order_id}, which is not announced yet"
            case RefusalReason.ORDER_CLOSED:
                why = f"belongs to {self.order_id}, which is already closed"
        return f"scored 0: kit type {self.kit_type!r} {why} (ordered now: {accepted})"


@dataclass(frozen=True, slots=True)
class KitScore:
    """The score of one kit.

    Attributes:
        is_submitted: True if a tray was judged; else there are no findings and no points.
        parts: a finding for each ordered part, in the order of the kit.
        extras: the unused objects, in the order of the tray's report.
        refusal: the reason why a submission was not judged, or None.
    """

    kit_type: str
    is_submitted: bool = False
    parts: tuple[PartFinding, ...] = ()
    extras: tuple[ExtraObject, ...] = ()
    refusal: Refusal | None = None

    @property
    def part_presence(self) -> float:
        """Points for ordered parts that are present."""
        return sum(part.presence for part in self.parts)

    @property
    def bonus(self) -> BonusVerdict | None:
        """Result for the bonus; None if no tray was judged."""
        if not self.is_submitted:
            return None
        if not all(part.is_present for part in self.parts):
            return BonusVerdict.PARTS_SHORT
        return BonusVerdict.EXTRA_OBJECTS if self.extras else BonusVerdict.EARNED

    @property
    def all_parts_bonus(self) -> float:
        """Points for a tray that holds exactly the ordered parts."""
        return BONUS_POINTS * len(self.parts) if self.bonus is BonusVerdict.EARNED else 0.0

    @property
    def part_pose(self) -> float:
        """Points for parts that lie in their places."""
        return sum(part.pose for part in self.parts)

    @property
    def total(self) -> float:
        """All points of this kit."""
        return self.part_presence + self.all_parts_bonus + self.part_pose

    @property
    def maximum(self) -> float:
        """Largest possible points of the findings; 0 if no tray was judged."""
        return (PRESENCE_POINTS + BONUS_POINTS + POSE_POINTS) * len(self.parts)

    @property
    def is_complete(self) -> bool:
        """True if every ordered part lies in its place."""
        return self.is_submitted and all(part.verdict is Verdict.PLACED for part in self.parts)


def score_kit(kit: Kit, contents: TrayContents) -> KitScore:
    """Judge the contents of a tray as a kit, by the rules of the 2017 competition.

    Faulty objects never count. The others are taken in the order of the report. Each fills the first open place of its
    type in which it lies within the tolerances. The remaining objects are matched with the open places of their type,
    the closest pair first. They earn the points for presence, and show what is wrong with their pose.
    """
    matching = _Matching(kit)
    good = [index for index, each in enumerate(contents) if not each.is_faulty]
    faulty = [index for index, each in enumerate(contents) if each.is_faulty]
    unused = matching.place(good, contents)
    surplus = matching.pair_up(unused, contents)
    # a faulty part fills no place, but is reported where one is open
    matching.pair_up(faulty, contents)
    ordered = {goal.type for goal in kit.objects}
    extras = []
    for found in (contents[index] for index in sorted(surplus + faulty)):
        reason = ExtraReason.SURPLUS if found.type in ordered else ExtraReason.WRONG_TYPE
        extras.append(ExtraObject(found.name, found.type, ExtraReason.FAULTY if found.is_faulty else reason))
    return KitScore(kit.kit_type, is_submitted=True, parts=matching.findings(), extras=tuple(extras))


def fit_of(goal: KitObject, found: TrayObject) -> Fit:
    """Compare an object with an ordered part."""
    gx, gy, _ = goal.pose.position
    fx, fy, _ = found.tray_T_object.position
    goal_q, found_q = goal.pose.quaternion, found.tray_T_object.quaternion
    # q and -q are the same turn, hence the absolute value; of two yaws the shorter way round counts.
    dot = abs(sum(a * b for a, b in zip(goal_q, found_q, strict=True)))
    turn = abs(rpy_from_quaternion(normalized(goal_q))[2] - rpy_from_quaternion(normalized(found_q))[2])
    return Fit(found.name, math.hypot(gx - fx, gy - fy), dot, min(turn, abs(turn - 2 * math.pi)))


def verdict_of(fit: Fit) -> Verdict:
    """Return the verdict for a good part with this fit."""
    if not fit.distance <= MAX_DISTANCE:
        return Verdict.TOO_FAR
    if not fit.quaternion_dot >= MIN_QUATERNION_DOT:
        return Verdict.TILTED
    return Verdict.PLACED if fit.yaw_difference <= MAX_YAW_DIFFERENCE else Verdict.TURNED


class _Matching:
    """Places of one kit while they are being filled; objects are identified by their index on the tray."""

    def __init__(self, kit: Kit) -> None:
        self._goals = kit.objects
        self._found: dict[int, tuple[Verdict, Fit]] = {}

    def place(self, indices: Sequence[int], contents: TrayContents) -> list[int]:
        """Assign objects to the places in which they lie within the tolerances; return the unassigned ones."""
        unused = []
        for index in indices:
            for goal in self._open(contents[index].type):
                fit = fit_of(self._goals[goal], contents[index])
                if verdict_of(fit) is Verdict.PLACED:
                    self._found[goal] = (Verdict.PLACED, fit)
                    break
            else:
                unused.append(index)
        return unused

    def pair_up(self, indices: Sequence[int], contents: TrayContents) -> list[int]:
        """Assign objects to places that are still open, the closest pair first; return the unassigned ones."""
        pairs = [
            (fit.distance, goal, index, fit)
            for index in indices
            for goal in self._open(contents[index].type)
            for fit in [fit_of(self._goals[goal], contents[index])]
        ]
        used: set[int] = set()
        # Greedy, closest pair first; equal distances go by the order of the kit and then of the report.
        for _distance, goal, index, fit in sorted(pairs, key=lambda pair: pair[:3]):
            if goal not in self._found and index not in used:
                used.add(index)
                self._found[goal] = (Verdict.FAULTY if contents[index].is_faulty else verdict_of(fit), fit)
        return [index for index in indices if index not in used]

    def findings(self) -> tuple[PartFinding, ...]:
        return tuple(
            PartFinding(goal.type, goal.pose, *self._found.get(number, (Verdict.MISSING,)))
            for number, goal in enumerate(self._goals)
        )

    def _open(self, part_type: str) -> list[int]:
        return [n for n, goal in enumerate(self._goals) if goal.type == part_type and n not in self._found]
