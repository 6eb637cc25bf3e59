"""Results made by hand."""

from __future__ import annotations

from typing import Any

from cellwright.running.evaluation.results.result import Result

PART = {
    "type": "gear_part",
    "verdict": "placed",
    "presence": 1.0,
    "pose": 1.0,
    "reachable_presence": 1.0,
    "reachable_pose": 1.0,
    "distance": 0.0042,
    "yaw_difference": 0.05,
    "sentence": "bin1|gear_part_1 lies in its place, off by 4.2 mm and 50 mrad",
}
MISSING = {
    **PART,
    "verdict": "missing",
    "presence": 0.0,
    "pose": 0.0,
    "distance": None,
    "yaw_difference": None,
    "sentence": "none on the tray <when> submitted",
}
KIT = {
    "kit_type": "order_0_kit_0",
    "submitted": True,
    "total": 2.0,
    "reachable": 6.0,
    "best": 6.0,
    "part_presence": 1.0,
    "all_parts_bonus": 0.0,
    "part_pose": 1.0,
    "bonus": "parts short",
    "bonus_reason": "an ordered part is not there",
    "parts": [PART, MISSING],
    "extras": [{"name": "bin2|disk_part_1", "type": "disk_part", "reason": "wrong type"}],
}
NEVER = {
    **KIT,
    "kit_type": "order_0_kit_1",
    "submitted": False,
    "reachable": 4.0,
    "bonus": None,
    "bonus_reason": "its kit was never submitted",
    "parts": [],
    "extras": [],
    "total": 0.0,
}
SCORE = {"total": 2.0, "best": 12.0, "orders": [{"order_id": "order_0", "kits": [KIT, NEVER]}]}
TIMELINE = {
    "end": 20.0,
    "orders": [
        {"order": "order_0", "announced": 0.0, "completed": 15.0},
        {"order": "order_1", "announced": 5.0, "completed": None},
    ],
    "kits": [
        {"time": 14.0, "agv": "1", "kit": "order_0_kit_0", "points": 2.0},
        {"time": 19.5, "agv": "2", "kit": "<kit>", "points": 0.0},
    ],
    "held": [{"begin": 2.0, "end": 4.0, "part": "bin1|gear_part_1", "type": "gear_part"}],
    "agvs": {
        "1": [
            {"begin": 0.0, "end": 13.0, "state": "ready_to_deliver"},
            {"begin": 13.0, "end": 14.0, "state": "preparing_to_deliver"},
            {"begin": 14.0, "end": None, "state": "delivering"},
        ],
        "2": [{"begin": 0.0, "end": None, "state": "ready_to_deliver"}],
    },
}


def result(points: float = 12.0, **changes: Any) -> Result:
    """Return a result; by default that of a perfect run."""
    known: dict[str, Any] = {
        "key": f"{changes.get('trial', 'tiny')}-{changes.get('seed', 1)}",
        "trial": "tiny",
        "agent": "my.py:Mine",
        "seed": 1,
        "vary": False,
        "outcome": "done",
        "points": points,
        "reachable": 12.0,
        "best": 15.0,
        "wall": 2.0,
        "simulated": 20.0,
        "limits": {"wall": 600.0, "memory": 1.0, "log": 1.0},
    }
    return Result(**(known | changes))


def worked(points: float = 2.0, **changes: Any) -> Result:
    """Return a result with a score and a timeline."""
    return result(points, **({"score": SCORE, "timeline": TIMELINE} | changes))


CRASHED = worked(
    seed=2, outcome="crashed", reason="ValueError: <no> & \x07", log=("Traceback", "ValueError: <no> & \x07 \x1b[31m")
)
LOST = result(0.0, seed=3, outcome="wall_limit", reason="still running after 5 s", simulated=3.0)
