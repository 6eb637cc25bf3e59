"""Tests of the form of a result: reading one checks every value that a report reads."""

from typing import Any

import pytest

from cellwright.running.evaluation.outputs.report import report
from cellwright.running.evaluation.results.result import Result, ResultError
from tests.running.evaluation.made_results import result

PART: dict[str, Any] = {
    "type": "gear_part", "sentence": "there", "presence": 1, "pose": 0.0, "reachable_presence": 1, "reachable_pose": 1,
    "distance": 0.004, "yaw_difference": None,
}  # fmt: skip
KIT: dict[str, Any] = {
    "kit_type": "order_0_kit_0", "submitted": True, "bonus_reason": "all there", "total": 1, "reachable": 2, "best": 3,
    "part_presence": 1, "all_parts_bonus": 0, "part_pose": 0, "parts": [PART], "extras": [{"name": "a", "reason": "b"}],
}  # fmt: skip
SCORE: dict[str, Any] = {"orders": [{"order_id": "order_0", "kits": [KIT]}]}
TIMELINE: dict[str, Any] = {
    "end": 3.0,
    "orders": [{"order": "order_0", "announced": 1.0, "completed": None}],
    "kits": [{"time": 2.0, "agv": "1", "kit": "order_0_kit_0", "points": 1.0}],
    "held": [{"begin": 1.0, "end": None, "part": "gear_part_1"}],
    "agvs": {"1": [{"begin": 0.0, "end": 1, "state": "ready_to_deliver"}]},
}
WHOLE: dict[str, Any] = Result(
    "k", "lesson", "a.py:A", 1, False, "done", 1.0, 2.0, 3.0, 4.0, 5.0, score=SCORE, timeline=TIMELINE, log=("x",)
).as_json()


def changed(way: str, value: object) -> dict[str, Any]:
    """Return the result with one value replaced, or removed if the value is ...; `way` is dotted."""

    def renew(node: Any, steps: list[str]) -> Any:
        if not steps:
            return value
        step: Any = int(steps[0]) if isinstance(node, list) else steps[0]
        copy: Any = list(node) if isinstance(node, list) else dict(node)
        if value is ... and len(steps) == 1:
            del copy[step]
        else:
            copy[step] = renew(copy[step], steps[1:])
        return copy

    document: dict[str, Any] = renew({**WHOLE, "log": list(WHOLE["log"])}, way.split("."))
    return document


def test_result_from_json_gives_same_json_and_report() -> None:
    read = Result.from_json(changed("log", ["x"]))
    assert read.as_json() == WHOLE
    assert "order_0_kit_0" in report([read], None)


@pytest.mark.parametrize(
    ("way", "value", "what"),
    [
        ("trial", 3, "trial must be a string"),
        ("key", {}, "key must be a string"),
        ("points", "8", "points must be a finite number"),
        ("wall", float("nan"), "wall must be a finite number"),
        ("best", 10**400, "best must be a finite number"),
        ("seed", True, "seed must be a whole number"),
        ("vary", 0, "vary must be true or false"),
        ("log", "x", "log must be a list"),
        ("log", [1], r"log\[0\] must be a string"),
        ("limits", {"wall": "x"}, "limits.wall must be a finite number"),
        ("limits", 3, "limits must be an object"),
        ("score", [], "score must be an object"),
        ("score.orders.0.kits.0.total", None, r"score.orders\[0\].kits\[0\].total must be a finite number"),
        ("score.orders.0.kits.0.parts.0.sentence", ..., r"parts\[0\].sentence is missing"),
        ("score.orders.0.kits.0.parts.0.distance", "4 mm", r"parts\[0\].distance must be a finite number"),
        ("timeline.end", ..., "timeline.end is missing"),
        ("timeline.held.0.end", "x", r"timeline.held\[0\].end must be a finite number"),
        ("timeline.agvs.1", 3, "timeline.agvs.1 must be a list"),
    ],
)
def test_misfit_in_result_is_refused_with_place(way: str, value: object, what: str) -> None:
    with pytest.raises(ResultError, match=f"not a result of this version of Cellwright: .*{what}"):
        Result.from_json(changed(way, value))


def test_lost_run_without_score_and_timeline_is_valid() -> None:
    bare = {**WHOLE, "log": [], "score": {}, "timeline": {}}
    assert "lesson" in report([Result.from_json(bare)], None)


@pytest.mark.parametrize(
    ("outcome", "kind"),
    [
        ("done", "none"),
        ("unstable", "simulation"),
        *[(each, "policy") for each in ("crashed", "gave_up", "time_limit", "wall_limit", "died", "no_order")],
    ],
)
def test_cause_of_an_end_is_one_of_three_classes(outcome: str, kind: str) -> None:
    assert result(outcome=outcome).error_class == kind
    # nothing went wrong in a trial without an order
    assert result(0.0, outcome="no_order", reachable=0.0).error_class == "none"
