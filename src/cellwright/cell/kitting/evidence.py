"""Evidence of a score: reasons for each point that a trial earned or lost, also as JSON values.

A `GameScore` holds only judged kits. The evidence covers the whole trial: it also lists kits that were never submitted
and orders that were never announced, with the points attainable there.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

from cellwright.cell.kitting.attainable import AttainableKit, AttainablePart, AttainableScore, attainable_score
from cellwright.cell.kitting.fates import Fate
from cellwright.cell.kitting.inventory import TrayContents
from cellwright.cell.kitting.kit_score import (
    MAX_DISTANCE,
    MAX_YAW_DIFFERENCE,
    MIN_QUATERNION_DOT,
    BonusVerdict,
    Fit,
    KitScore,
    PartFinding,
    Verdict,
)
from cellwright.cell.kitting.scorer import GameScore, OrderScore, TrialScore, system_cost
from cellwright.cell.kitting.unsent import UnsentTray, unsent_trays
from cellwright.config.trial.trial import Trial
from cellwright.engine.clock import seconds

NOT_SUBMITTED = "not submitted"
ON_ITS_WAY = "on its way"
NOT_ANNOUNCED = "not announced"
OFF_TRAY = "off tray"
NO_PARTS = "no part lay on a waiting tray"

MAX_TILT = 2.0 * math.acos(MIN_QUATERNION_DOT)
"""Largest accepted turn of a part about any axis [rad]; `MIN_QUATERNION_DOT` as an angle."""

REASONS: Mapping[str, str] = MappingProxyType(
    {
        Verdict.TOO_FAR: f"present, but more than {MAX_DISTANCE * 1e3:g} mm from its place",
        OFF_TRAY: "its place lies off the tray, out of reach of any part",
        Verdict.TILTED: "in its place, but not the ordered side up "
        f"(more than {MAX_TILT * 1e3:.0f} mrad, {math.degrees(MAX_TILT):.0f} deg)",
        Verdict.TURNED: "in its place, but turned by more than "
        f"{MAX_YAW_DIFFERENCE * 1e3:g} mrad ({math.degrees(MAX_YAW_DIFFERENCE):.1f} deg)",
        Verdict.FAULTY: "only a faulty one, which does not count",
        Verdict.MISSING: "not on the tray at submission",
        NOT_SUBMITTED: "its kit was never submitted",
        ON_ITS_WAY: "its AGV was on its way, and had not submitted the kit yet",
        NOT_ANNOUNCED: "its order was never announced",
        BonusVerdict.PARTS_SHORT: "an ordered part is missing, so there is no bonus",
        BonusVerdict.EXTRA_OBJECTS: "the tray holds more than was ordered, so there is no bonus",
    }
)
"""Explanation of each cause of a loss, in one sentence."""

_ORDER_TERMS = ("order_id", "completion", "time_taken", "efficiency", "efficiency_points")


def turn_angle(fit: Fit) -> float:
    """Return the angle between the orientations of an object and of its place, about any axis [rad]."""
    return 2.0 * math.acos(min(1.0, fit.quaternion_dot))


@dataclass(frozen=True, slots=True)
class PartEvidence:
    """Evidence of one ordered part.

    Attributes:
        cause: one word for the result, a key of `REASONS`, or "placed".
        finding: the referee's finding; None if the kit was not judged.
        fate: fate of a missing part; None if unknown.
    """

    attainable: AttainablePart
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
        """Explanation of the points earned or lost, with the measured values."""
        fit = None if self.finding is None else self.finding.fit
        if fit is None or self.cause == Verdict.FAULTY:
            more = fit.object_name if fit is not None else self.fate.sentence() if self.fate is not None else ""
            why = ": ".join(filter(None, (REASONS[self.cause], more)))
            return "; ".join(filter(None, (why, self.attainable.reason())))
        off, yaw, tilt = fit.distance * 1e3, fit.yaw_difference * 1e3, turn_angle(fit) * 1e3
        match self.cause:
            case Verdict.TILTED:
                lies = f"turned over by {tilt:.0f} mrad, {tilt - MAX_TILT * 1e3:.0f} mrad too far"
            case Verdict.TURNED:
                lies = f"turned by {yaw:.0f} mrad, {yaw - MAX_YAW_DIFFERENCE * 1e3:.0f} mrad too far"
            case Verdict.PLACED:
                lies = f"in its place, off by {off:.1f} mm and {yaw:.0f} mrad"
            case _:
                lies = f"{off:.1f} mm from its place, {off - MAX_DISTANCE * 1e3:.1f} mm too far"
        return "; ".join(filter(None, (f"{fit.object_name} lies {lies}", self.attainable.reason())))


@dataclass(frozen=True, slots=True)
class KitEvidence:
    """Evidence of one kit: attainable points, the referee's score, and each ordered part.

    Attributes:
        unsent: for a kit of an announced order that was not submitted, the waiting trays with parts; else None.
    """

    attainable: AttainableKit
    score: KitScore
    parts: tuple[PartEvidence, ...]
    unsent: tuple[UnsentTray, ...] | None = None

    def reason(self, cause: str) -> str:
        """Return the explanation of a cause of a loss, with the size of the trays that places lie off."""
        sizes = dict.fromkeys(part.attainable.plate_size for part in self.parts if part.cause == OFF_TRAY)
        if cause != OFF_TRAY or not sizes:
            return REASONS[cause]
        return REASONS[cause].replace("the tray", f"the tray ({' or '.join(sizes)})")

    def unsent_sentences(self) -> Iterator[str]:
        """Yield a sentence for each tray that waited with parts while the kit was open, or one that none did."""
        if self.unsent is not None:
            yield from (each.sentence() for each in self.unsent)
            if not self.unsent:
                yield NO_PARTS

    @property
    def bonus_sentence(self) -> str:
        """Explanation of the bonus, earned or not; for a kit without a submission, why there is none."""
        match self.score.bonus:
            case None:
                why = [REASONS[self.parts[0].cause]] if self.parts else []
                return "; ".join([*why, *self.unsent_sentences()])
            case BonusVerdict.EARNED:
                return "the tray held exactly what was ordered"
            case lost:
                return REASONS[lost]


@dataclass(frozen=True, slots=True)
class OrderEvidence:
    """Evidence of one order; the score of an order that was never announced is zero."""

    score: OrderScore
    is_announced: bool
    kits: tuple[KitEvidence, ...]


@dataclass(frozen=True, slots=True)
class Evidence:
    """Evidence of a trial.

    Attributes:
        orders: announced orders in that order, then the orders that were never announced.
        part_travel_time: time in which the gripper was enabled and held something [ns].
        process_time: from the start to the end of the game, or until now [ns].
        system_cost: cost of the sensors [$].
    """

    orders: tuple[OrderEvidence, ...]
    attainable: AttainableScore
    part_travel_time: int
    process_time: int
    system_cost: float

    @property
    def total(self) -> float:
        """All points."""
        return sum(order.score.total for order in self.orders)


def kit_evidence(
    score: KitScore, attainable: AttainableKit, *, is_announced: bool = True, fates: Sequence[Fate | None] = ()
) -> KitEvidence:
    """Return the evidence of one kit, from the referee's score and the attainable points.

    Args:
        score: the referee's score of the kit.
        attainable: the attainable points of the kit.
        is_announced: True if its order was announced; used only for a kit that was not submitted.
        fates: one for each ordered part; empty if unknown.
    """
    if score.is_submitted:
        parts = tuple(
            PartEvidence(
                part,
                OFF_TRAY if finding.verdict is Verdict.TOO_FAR and part.is_off_tray else str(finding.verdict),
                finding,
                fate,
            )
            for part, finding, fate in zip(
                attainable.parts, score.parts, fates or [None] * len(score.parts), strict=True
            )
        )
    else:
        cause = NOT_SUBMITTED if is_announced else NOT_ANNOUNCED
        parts = tuple(PartEvidence(part, cause) for part in attainable.parts)
    return KitEvidence(attainable, score, parts)


def evidence(
    trial: Trial,
    score: GameScore,
    process_time: int = 0,
    *,
    attainable: AttainableScore | None = None,
    fates: Mapping[str, Sequence[Fate | None]] = MappingProxyType({}),
    trays: Mapping[str, TrayContents] | None = None,
    sent: Mapping[str, str] = MappingProxyType({}),
) -> Evidence:
    """Return the evidence for a score of the trial that was played.

    Args:
        trial: the trial.
        score: the score of the game.
        process_time: time from the start to the end of the game [ns].
        attainable: the attainable points, if known already.
        fates: fates of the parts that judged kits lack, by kit type; see `kit_evidence`.
        trays: contents of the trays at their stations, by link, for kits that were not submitted; None if unknown.
        sent: kit types that AGVs have been sent with and not submitted yet, by the tray's link.
    """
    attainable = attainable or attainable_score(trial)
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
                    attainable.kit(kit.kit_type),
                    is_announced=order.order_id in announced,
                    fates=fates.get(kit.kit_type, ()),
                )
                for kit in order.kits
            ),
        )
        for order in (*score.orders, *silent)
    )
    if trays is not None or sent:
        orders = tuple(_with_trays(order, trial, trays, sent) for order in orders)
    return Evidence(orders, attainable, score.part_travel_time, process_time, system_cost(trial.sensors))


def _with_trays(
    found: OrderEvidence, trial: Trial, trays: Mapping[str, TrayContents] | None, sent: Mapping[str, str]
) -> OrderEvidence:
    """Return the evidence of an order with the trays that wait for its kits that were not submitted."""
    if not found.is_announced:
        return found
    kits = {kit.kit_type: kit for order in trial.orders for kit in order.kits}

    def with_trays(kit: KitEvidence) -> KitEvidence:
        if kit.score.is_submitted:
            return kit
        unsent = None if trays is None else unsent_trays(kits[kit.score.kit_type], trays, sent)
        if kit.score.kit_type not in sent.values():
            return replace(kit, unsent=unsent)
        return replace(kit, unsent=unsent, parts=tuple(replace(part, cause=ON_ITS_WAY) for part in kit.parts))

    return replace(found, kits=tuple(map(with_trays, found.kits)))


def evidence_to_json(found: Evidence) -> dict[str, Any]:
    """Return a trial's score with all its evidence as JSON values."""
    return {
        "total": found.total,
        "reachable": found.attainable.total,
        "best": found.attainable.maximum,
        "reachable_reason": found.attainable.sentence(),
        "process_time": seconds(found.process_time),
        "part_travel_time": seconds(found.part_travel_time),
        "system_cost": found.system_cost,
        "orders": [_order_to_json(order) for order in found.orders],
    }


def kit_to_json(found: KitEvidence) -> dict[str, Any]:
    """Return a kit's score with its evidence as JSON values."""
    score, attainable = found.score, found.attainable
    return {
        "kit_type": score.kit_type,
        "submitted": score.is_submitted,
        "total": score.total,
        "reachable": attainable.total,
        "best": attainable.maximum,
        "part_presence": score.part_presence,
        "all_parts_bonus": score.all_parts_bonus,
        "part_pose": score.part_pose,
        "bonus": None if score.bonus is None else str(score.bonus),
        "bonus_reason": found.bonus_sentence,
        "out_of_reach": list(attainable.reasons()),
        "parts": [_part_to_json(part) for part in found.parts],
        "extras": [{"name": each.name, "type": each.type, "reason": str(each.reason)} for each in score.extras],
        "unsent": None if found.unsent is None else [each.as_json() for each in found.unsent],
    }


def trial_score_to_json(score: TrialScore) -> dict[str, Any]:
    """Return the score of a trial in the 2017 finals, term by term, as JSON values."""
    return {
        "total": score.total,
        "cost_factor": score.cost_factor,
        "cost_points": score.cost_points,
        "orders": [{name: getattr(order, name) for name in _ORDER_TERMS} for order in score.orders],
    }


def _order_to_json(found: OrderEvidence) -> dict[str, Any]:
    score = found.score
    return {
        "order_id": score.order_id,
        "announced": found.is_announced,
        "total": score.total,
        "reachable": sum(kit.attainable.total for kit in found.kits),
        "complete": score.is_complete,
        "time_taken": seconds(score.time_taken),
        "kits": [kit_to_json(kit) for kit in found.kits],
    }


def _part_to_json(found: PartEvidence) -> dict[str, Any]:
    finding, attainable = found.finding, found.attainable
    fit = None if finding is None else finding.fit
    return {
        "type": attainable.type,
        "cause": found.cause,
        "sentence": found.sentence(),
        "fate": None if found.fate is None else _fate_to_json(found.fate),
        "verdict": None if finding is None else str(finding.verdict),
        "presence": found.presence,
        "pose": found.pose,
        "reachable_presence": attainable.presence,
        "reachable_pose": attainable.pose,
        "place": {
            "position": list(attainable.tray_T_goal.position),
            "quaternion": list(attainable.tray_T_goal.quaternion),
            "off_plate": attainable.off_plate,
            "nearest": attainable.nearest,
        },
        "object": None if fit is None else fit.object_name,
        "distance": None if fit is None else fit.distance,
        "yaw_difference": None if fit is None else fit.yaw_difference,
        "turn": None if fit is None else turn_angle(fit),
        "quaternion_dot": None if fit is None else fit.quaternion_dot,
    }


def _fate_to_json(fate: Fate) -> dict[str, Any]:
    return {
        "kind": str(fate.kind),
        "sentence": fate.sentence(),
        "part": fate.part or None,
        "faulty": fate.is_faulty,
        "position": None if fate.position is None else list(fate.position),
        "time": None if fate.time is None else seconds(fate.time),
        "held": seconds(fate.held),
        "lies": None if fate.lies is None else list(fate.lies),
        "tray": fate.tray or None,
        "past": fate.past + fate.fallen,
    }
