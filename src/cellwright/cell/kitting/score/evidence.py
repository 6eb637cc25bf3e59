"""The score of a trial with its evidence: for each point what earned it or lost it, and by how much.

Where the `GameScore` has what was judged, this goes through the whole trial: also the kits that were never submitted
and the orders that were never announced, with what could have been had there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from cellwright.cell.kitting.fates import Fate
from cellwright.cell.kitting.score.kit_score import BonusVerdict, Fit, KitScore, PartFinding, Verdict
from cellwright.cell.kitting.score.matching import MAX_DISTANCE, MAX_YAW_DIFFERENCE, MIN_QUATERNION_DOT
from cellwright.cell.kitting.score.reach import KitReach, PartReach, TrialReach, reach
from cellwright.cell.kitting.score.scorer import GameScore, OrderScore
from cellwright.cell.kitting.score.trial_score import system_cost
from cellwright.config.layout import TRAY_PLATE
from cellwright.config.trial.trial import Trial

NOT_SUBMITTED = "not submitted"
NOT_ANNOUNCED = "not announced"
OFF_TRAY = "off tray"

MAX_TILT = 2.0 * math.acos(MIN_QUATERNION_DOT)
"""How far a part may be turned about any axis [rad]: what `MIN_QUATERNION_DOT` says as an angle."""

REASONS: Mapping[str, str] = MappingProxyType(
    {
        Verdict.TOO_FAR: f"there, but more than {MAX_DISTANCE * 1e3:g} mm from its place",
        OFF_TRAY: f"its place lies off the tray ({TRAY_PLATE[0]:g} x {TRAY_PLATE[1]:g} m), out of reach of any part",
        Verdict.TILTED: "in its place, but not the ordered side up "
        f"(more than {MAX_TILT * 1e3:.0f} mrad, {math.degrees(MAX_TILT):.0f} deg)",
        Verdict.TURNED: "in its place, but turned by more than "
        f"{MAX_YAW_DIFFERENCE * 1e3:g} mrad ({math.degrees(MAX_YAW_DIFFERENCE):.1f} deg)",
        Verdict.FAULTY: "none but a faulty one, which does not count",
        Verdict.MISSING: "none on the tray when it was submitted",
        NOT_SUBMITTED: "its kit was never submitted",
        NOT_ANNOUNCED: "its order was never announced",
        BonusVerdict.PARTS_SHORT: "an ordered part is not there, so there is no bonus",
        BonusVerdict.EXTRA_OBJECTS: "the tray holds more than was ordered, so there is no bonus",
    }
)
"""What the words for a loss stand for, in one sentence each."""


def turn(fit: Fit) -> float:
    """The angle between the orientations of an object and of its place, about whatever axis [rad]."""
    return 2.0 * math.acos(min(1.0, fit.quaternion_dot))


@dataclass(frozen=True, slots=True)
class PartEvidence:
    """What became of one ordered part.

    Attributes:
        reach: what it could earn.
        cause: one word for it, a key of `REASONS`, or "placed".
        finding: what the referee found; None when its kit was not judged.
        fate: what became of it if it is missing; None where nothing is known.
    """

    reach: PartReach
    cause: str
    finding: PartFinding | None = None
    fate: Fate | None = None

    @property
    def presence(self) -> float:
        """Points for presence."""
        return 0.0 if self.finding is None else self.finding.presence

    @property
    def pose(self) -> float:
        """Points for pose."""
        return 0.0 if self.finding is None else self.finding.pose

    def sentence(self) -> str:
        """What earned or lost its points, and by how much."""
        fit = None if self.finding is None else self.finding.fit
        if fit is None or self.cause == Verdict.FAULTY:
            more = fit.object_name if fit is not None else self.fate.sentence() if self.fate is not None else ""
            why = ": ".join(filter(None, (REASONS[self.cause], more)))
            return "; ".join(filter(None, (why, self.reach.reason())))
        off, yaw, tilt = fit.distance * 1e3, fit.yaw_difference * 1e3, turn(fit) * 1e3
        match self.cause:
            case Verdict.TILTED:
                lies = f"turned over by {tilt:.0f} mrad, {tilt - MAX_TILT * 1e3:.0f} mrad too far"
            case Verdict.TURNED:
                lies = f"turned by {yaw:.0f} mrad, {yaw - MAX_YAW_DIFFERENCE * 1e3:.0f} mrad too far"
            case Verdict.PLACED:
                lies = f"in its place, off by {off:.1f} mm and {yaw:.0f} mrad"
            case _:
                lies = f"{off:.1f} mm from its place, {off - MAX_DISTANCE * 1e3:.1f} mm too far"
        return "; ".join(filter(None, (f"{fit.object_name} lies {lies}", self.reach.reason())))


@dataclass(frozen=True, slots=True)
class KitEvidence:
    """What became of one kit.

    Attributes:
        reach: what it could earn.
        score: what the referee says.
        parts: each ordered part, in the order of the kit.
    """

    reach: KitReach
    score: KitScore
    parts: tuple[PartEvidence, ...]

    @property
    def bonus_sentence(self) -> str:
        """Why there is or is no bonus."""
        match self.score.bonus:
            case None:
                return REASONS[self.parts[0].cause] if self.parts else ""
            case BonusVerdict.EARNED:
                return "the tray held exactly what was ordered"
            case lost:
                return REASONS[lost]


@dataclass(frozen=True, slots=True)
class OrderEvidence:
    """What became of one order.

    Attributes:
        score: what the referee says; all zero for an order that was never announced.
        is_announced: whether it came up.
        kits: its kits, in the order of the order.
    """

    score: OrderScore
    is_announced: bool
    kits: tuple[KitEvidence, ...]


@dataclass(frozen=True, slots=True)
class Evidence:
    """What became of a trial.

    Attributes:
        orders: those announced, in that order, then those that never came up.
        reach: what could be earned.
        part_travel_time: how long the gripper was enabled and held something [ns].
        process_time: from the start to the end of the game, or until now [ns].
        system_cost: cost of the sensors [$].
    """

    orders: tuple[OrderEvidence, ...]
    reach: TrialReach
    part_travel_time: int
    process_time: int
    system_cost: float

    @property
    def total(self) -> float:
        """All points."""
        return sum(order.score.total for order in self.orders)

    def kits(self) -> Iterator[KitEvidence]:
        """All kits, order by order."""
        for order in self.orders:
            yield from order.kits


def kit_evidence(
    score: KitScore, could: KitReach, *, is_announced: bool = True, fates: Sequence[Fate | None] = ()
) -> KitEvidence:
    """The evidence of one kit.

    Args:
        score: what the referee says of it.
        could: what it could earn.
        is_announced: whether its order came up, for a kit that was not submitted.
        fates: what became of its missing parts, one for each ordered part; empty where nothing is known.
    """
    if score.is_submitted:
        parts = tuple(
            PartEvidence(part, _cause(finding, part), finding, fate)
            for part, finding, fate in zip(could.parts, score.parts, fates or [None] * len(score.parts), strict=True)
        )
    else:
        cause = NOT_SUBMITTED if is_announced else NOT_ANNOUNCED
        parts = tuple(PartEvidence(part, cause) for part in could.parts)
    return KitEvidence(could, score, parts)


def evidence(
    trial: Trial,
    score: GameScore,
    process_time: int = 0,
    *,
    could: TrialReach | None = None,
    fates: Mapping[str, Sequence[Fate | None]] = MappingProxyType({}),
) -> Evidence:
    """The evidence for a score.

    Args:
        trial: the trial that was played.
        score: its score.
        process_time: from the start to the end of the game [ns].
        could: what can be earned in it, where that is known already.
        fates: what became of the parts that judged kits lack, by kit type; see `kit_evidence`.
    """
    could = could or reach(trial)
    announced = {order.order_id: order for order in score.orders}
    silent = [
        OrderScore(order.order_id, tuple(KitScore(kit.kit_type) for kit in order.kits))
        for order in trial.orders
        if order.order_id not in announced
    ]
    orders = tuple(
        OrderEvidence(
            order,
            order.order_id in announced,
            tuple(
                kit_evidence(
                    kit,
                    could.kit(kit.kit_type),
                    is_announced=order.order_id in announced,
                    fates=fates.get(kit.kit_type, ()),
                )
                for kit in order.kits
            ),
        )
        for order in (*score.orders, *silent)
    )
    return Evidence(orders, could, score.part_travel_time, process_time, system_cost(trial.sensors))


def _cause(finding: PartFinding, could: PartReach) -> str:
    if finding.verdict is Verdict.TOO_FAR and could.is_off_tray:
        return OFF_TRAY
    return str(finding.verdict)
