"""Evidence as JSON values, for programs: lengths in m, angles in rad, times in s, costs in $."""

from __future__ import annotations

from typing import Any

from cellwright.cell.kitting.fates import Fate
from cellwright.cell.kitting.score.evidence import Evidence, KitEvidence, OrderEvidence, PartEvidence, turn
from cellwright.cell.kitting.score.trial_score import TrialScore
from cellwright.engine.clock import seconds


def evidence_to_json(found: Evidence) -> dict[str, Any]:
    """A trial's score with all its evidence."""
    return {
        "total": found.total,
        "reachable": found.reach.total,
        "best": found.reach.maximum,
        "reachable_reason": found.reach.sentence(),
        "process_time": seconds(found.process_time),
        "part_travel_time": seconds(found.part_travel_time),
        "system_cost": found.system_cost,
        "orders": [_order(order) for order in found.orders],
    }


def kit_to_json(found: KitEvidence) -> dict[str, Any]:
    """A kit's score with its evidence."""
    score, could = found.score, found.reach
    return {
        "kit_type": score.kit_type,
        "submitted": score.is_submitted,
        "total": score.total,
        "reachable": could.total,
        "best": could.maximum,
        "part_presence": score.part_presence,
        "all_parts_bonus": score.all_parts_bonus,
        "part_pose": score.part_pose,
        "bonus": None if score.bonus is None else str(score.bonus),
        "bonus_reason": found.bonus_sentence,
        "out_of_reach": list(could.reasons()),
        "parts": [_part(part) for part in found.parts],
        "extras": [{"name": each.name, "type": each.type, "reason": str(each.reason)} for each in score.extras],
    }


def trial_score_to_json(score: TrialScore) -> dict[str, Any]:
    """The score of a trial in the finals, term by term."""
    return {
        "total": score.total,
        "cost_factor": score.cost_factor,
        "cost_points": score.cost_points,
        "orders": [
            {
                "order_id": order.order_id,
                "completion": order.completion,
                "time_taken": order.time_taken,
                "efficiency": order.efficiency,
                "efficiency_points": order.efficiency_points,
            }
            for order in score.orders
        ],
    }


def _order(found: OrderEvidence) -> dict[str, Any]:
    score = found.score
    return {
        "order_id": score.order_id,
        "announced": found.is_announced,
        "total": score.total,
        "reachable": sum(kit.reach.total for kit in found.kits),
        "complete": score.is_complete,
        "time_taken": seconds(score.time_taken),
        "kits": [kit_to_json(kit) for kit in found.kits],
    }


def _part(found: PartEvidence) -> dict[str, Any]:
    finding, could = found.finding, found.reach
    fit = None if finding is None else finding.fit
    return {
        "type": could.type,
        "cause": found.cause,
        "sentence": found.sentence(),
        "fate": None if found.fate is None else _fate(found.fate),
        "verdict": None if finding is None else str(finding.verdict),
        "presence": found.presence,
        "pose": found.pose,
        "reachable_presence": could.presence,
        "reachable_pose": could.pose,
        "place": {
            "position": list(could.tray_T_goal.position),
            "quaternion": list(could.tray_T_goal.quaternion),
            "off_plate": could.off_plate,
            "nearest": could.nearest,
        },
        "object": None if fit is None else fit.object_name,
        "distance": None if fit is None else fit.distance,
        "yaw_difference": None if fit is None else fit.yaw_difference,
        "turn": None if fit is None else turn(fit),
        "quaternion_dot": None if fit is None else fit.quaternion_dot,
    }


def _fate(fate: Fate) -> dict[str, Any]:
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
        "past": fate.past,
    }
