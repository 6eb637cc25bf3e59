"""The score of a kit, and the evidence for every point of it.

A `KitScore` holds what was found for each ordered part and for each object that was of no use; its points are computed
from these findings, so a score can never disagree with its explanation.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from cellwright.util.errors import did_you_mean
from cellwright.util.pose import Pose

PRESENCE_POINTS = 1.0
"""For each ordered part of which one lies on the tray."""
BONUS_POINTS = 1.0
"""For each ordered part, if the tray holds exactly what was ordered."""
POSE_POINTS = 1.0
"""For each ordered part of which one lies where it should."""


class Verdict(StrEnum):
    """What became of an ordered part. The first failing check is named; they go from `TOO_FAR` to `TURNED`."""

    PLACED = "placed"
    """One lies in its place: points for presence and pose."""
    TOO_FAR = "too far"
    """One is there, but its place is empty: points for presence."""
    TILTED = "tilted"
    """One lies in its place, but not with the ordered side up: points for presence."""
    TURNED = "turned"
    """One lies in its place, the right way up, with a wrong yaw: points for presence."""
    FAULTY = "faulty"
    """There is none but a faulty one: no points."""
    MISSING = "missing"
    """There is none: no points."""


class ExtraReason(StrEnum):
    """Why an object on the tray was of no use."""

    FAULTY = "faulty"
    WRONG_TYPE = "wrong type"
    """The kit has no part of this type."""
    SURPLUS = "surplus"
    """The kit has fewer parts of this type."""


class BonusVerdict(StrEnum):
    """Whether the bonus for a complete tray was earned, or why not."""

    EARNED = "earned"
    PARTS_SHORT = "parts short"
    EXTRA_OBJECTS = "extra objects"


class RefusalReason(StrEnum):
    """Why a submission was not scored."""

    UNKNOWN_KIT_TYPE = "unknown kit type"
    NOT_ANNOUNCED = "order not announced"
    ORDER_CLOSED = "order closed"


@dataclass(frozen=True, slots=True)
class Fit:
    """How an object on the tray compares with an ordered part.

    Attributes:
        object_name: full model name of the object.
        distance: between the two origins along the tray, height left out [m].
        quaternion_dot: |q1.q2| of the two orientations, 1 when they are equal.
        yaw_difference: the shorter way round between the two yaws, 0 to pi [rad].
    """

    object_name: str
    distance: float
    quaternion_dot: float
    yaw_difference: float


@dataclass(frozen=True, slots=True)
class PartFinding:
    """What was found for one ordered part.

    Attributes:
        type: the ordered type.
        tray_T_goal: where it was to be.
        verdict: what became of it.
        fit: the object that stands for it and how it lies; None when the part is missing.
    """

    type: str
    tray_T_goal: Pose
    verdict: Verdict
    fit: Fit | None = None

    @property
    def is_present(self) -> bool:
        """Whether a good part of the type stands for it."""
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
    """An object on the tray that stands for no ordered part."""

    name: str
    type: str
    reason: ExtraReason


@dataclass(frozen=True, slots=True)
class Refusal:
    """A submission that earned nothing because its kit was not asked for at that time.

    Attributes:
        reason: why.
        kit_type: what was submitted.
        order_id: the order that the kit belongs to; None when there is none.
        wanted: the kit types that would have been scored.
    """

    reason: RefusalReason
    kit_type: str
    order_id: str | None = None
    wanted: tuple[str, ...] = ()

    def sentence(self) -> str:
        """The refusal in one sentence, for a person to read."""
        known = ", ".join(self.wanted) or "none"
        match self.reason:
            case RefusalReason.UNKNOWN_KIT_TYPE:
                why = f"belongs to no order{did_you_mean(self.kit_type, self.wanted)}"
            case RefusalReason.NOT_ANNOUNCED:
                why = f"belongs to {self.order_id}, which has not been announced yet"
            case RefusalReason.ORDER_CLOSED:
                why = f"belongs to {self.order_id}, which is closed already"
        return f"scored 0: kit type {self.kit_type!r} {why} (asked for now: {known})"


@dataclass(frozen=True, slots=True)
class KitScore:
    """The score of one kit.

    Attributes:
        kit_type: which kit.
        is_submitted: whether a tray was judged; if not, there are no findings and no points.
        parts: a finding for each ordered part, in the order of the kit.
        extras: the objects that were of no use, in the order in which the tray reported them.
        refusal: why a submission was not judged.
    """

    kit_type: str
    is_submitted: bool = False
    parts: tuple[PartFinding, ...] = ()
    extras: tuple[ExtraObject, ...] = ()
    refusal: Refusal | None = None

    @property
    def part_presence(self) -> float:
        """Points for parts that are there."""
        return sum(part.presence for part in self.parts)

    @property
    def bonus(self) -> BonusVerdict | None:
        """Whether the bonus was earned, or why not; None when no tray was judged."""
        if not self.is_submitted:
            return None
        if not all(part.is_present for part in self.parts):
            return BonusVerdict.PARTS_SHORT
        return BonusVerdict.EXTRA_OBJECTS if self.extras else BonusVerdict.EARNED

    @property
    def all_parts_bonus(self) -> float:
        """Points for a tray that holds what was ordered and nothing else."""
        return BONUS_POINTS * len(self.parts) if self.bonus is BonusVerdict.EARNED else 0.0

    @property
    def part_pose(self) -> float:
        """Points for parts that lie where they should."""
        return sum(part.pose for part in self.parts)

    @property
    def total(self) -> float:
        """All points of this kit."""
        return self.part_presence + self.all_parts_bonus + self.part_pose

    @property
    def maximum(self) -> float:
        """The points that the findings could have brought at best; 0 when no tray was judged."""
        return (PRESENCE_POINTS + BONUS_POINTS + POSE_POINTS) * len(self.parts)

    @property
    def is_complete(self) -> bool:
        """Whether every ordered part lies where it should."""
        return self.is_submitted and all(part.verdict is Verdict.PLACED for part in self.parts)
