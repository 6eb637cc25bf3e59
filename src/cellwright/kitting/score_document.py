"""A score as programs read it: JSON values in SI units."""

from __future__ import annotations

from typing import Any

from cellwright.description.trial import Trial
from cellwright.kitting.kit_score import BONUS_POINTS, POSE_POINTS, PRESENCE_POINTS, KitScore, PartFinding
from cellwright.kitting.scorer import GameScore

_POINTS_A_PART = PRESENCE_POINTS + BONUS_POINTS + POSE_POINTS


def best(trial: Trial) -> float:
    """The points of a perfect game: three for each ordered part."""
    return _POINTS_A_PART * sum(len(kit.objects) for order in trial.orders for kit in order.kits)


def of_score(score: GameScore, trial: Trial) -> dict[str, Any]:
    """A score; lengths in m, angles in rad, times in s."""
    return {
        "total": score.total,
        "best": best(trial),
        "part_travel_time": score.part_travel_time / 1e9,
        "orders": [
            {
                "order_id": order.order_id,
                "total": order.total,
                "complete": order.is_complete,
                "time_taken": order.time_taken / 1e9,
                "kits": [_kit(kit) for kit in order.kits],
            }
            for order in score.orders
        ],
    }


def _kit(kit: KitScore) -> dict[str, Any]:
    return {
        "kit_type": kit.kit_type,
        "submitted": kit.is_submitted,
        "total": kit.total,
        "part_presence": kit.part_presence,
        "all_parts_bonus": kit.all_parts_bonus,
        "part_pose": kit.part_pose,
        "bonus": None if kit.bonus is None else str(kit.bonus),
        "parts": [_part(part) for part in kit.parts],
        "extras": [{"name": each.name, "type": each.type, "reason": str(each.reason)} for each in kit.extras],
    }


def _part(part: PartFinding) -> dict[str, Any]:
    fit = part.fit
    return {
        "type": part.type,
        "verdict": str(part.verdict),
        "presence": part.presence,
        "pose": part.pose,
        "object": None if fit is None else fit.object_name,
        "distance": None if fit is None else fit.distance,
        "yaw_difference": None if fit is None else fit.yaw_difference,
        "quaternion_dot": None if fit is None else fit.quaternion_dot,
    }
