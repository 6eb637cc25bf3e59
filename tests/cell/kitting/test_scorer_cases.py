"""Results of the 2017 competition's own scorer, case by case, and cases of its rules for withdrawn orders."""

from typing import Any

import pytest

from cellwright.cell.kitting.inventory import TrayContents, TrayObject, part_type, trimmed_name
from cellwright.cell.kitting.kit_score import KitScore
from cellwright.cell.kitting.scorer import GameScore, Scorer
from cellwright.config.trial.trial import Kit, KitObject, Order
from cellwright.engine.clock import nanoseconds, seconds
from cellwright.util.pose import Pose
from tests.conftest import load_cases

CASES = load_cases("scorer_cases.json")
WITHDRAWALS = load_cases("withdrawal_cases.json")


def pose(values: dict[str, Any]) -> Pose:
    x, y, z = values["xyz"]
    qw, qx, qy, qz = values["q"]
    return Pose((x, y, z), (qw, qx, qy, qz))


def order(operation: dict[str, Any]) -> Order:
    kits = tuple(
        Kit(kit["kit_type"], tuple(KitObject(each["type"], pose(each)) for each in kit["objects"]))
        for kit in operation["kits"]
    )
    return Order(operation["order_id"], kits)


def kit_score(score: KitScore) -> dict[str, Any]:
    names = ("total", "part_presence", "all_parts_bonus", "part_pose", "is_complete", "is_submitted")
    return {name: getattr(score, name) for name in names}


def game_score(score: GameScore) -> dict[str, Any]:
    return {
        "total": score.total,
        "part_travel_time": pytest.approx(seconds(score.part_travel_time), abs=1e-9),
        "orders": {
            each.order_id: {
                "total": each.total,
                "time_taken": pytest.approx(seconds(each.time_taken), abs=1e-9),
                "complete": each.is_complete,
            }
            for each in score.orders
        },
    }


class Player:
    """Player that applies the operations of a case to a scorer and returns its answers."""

    def __init__(self, case: dict[str, Any]) -> None:
        self.scorer = Scorer([order(each) for each in case["ops"] if each["op"] == "order"])
        self.trays: dict[str, TrayContents] = {}
        self.now = 0
        self.scorer.begin(self.now)

    def play(self, operation: dict[str, Any]) -> Any:
        return getattr(self, operation["op"])(operation)

    def order(self, operation: dict[str, Any]) -> None:
        self.scorer.announce(operation["order_id"], self.now)

    def tray(self, operation: dict[str, Any]) -> None:
        contents = tuple(
            TrayObject(f"{each['type']}_{number}", each["type"], each["is_faulty"], pose(each))
            for number, each in enumerate(operation["objects"])
        )
        self.trays[operation["tray"]] = contents

    def submit(self, operation: dict[str, Any]) -> dict[str, Any]:
        if (contents := self.trays.get(operation["tray"])) is None:
            return {"error": "unknown_tray"}
        return kit_score(self.scorer.submit(operation["kit_type"], contents, self.now))

    def update(self, operation: dict[str, Any]) -> None:
        self.now += nanoseconds(operation["dt"])

    def gripper(self, operation: dict[str, Any]) -> None:
        self.scorer.gripper_changed(self.now, enabled=operation["enabled"], attached=operation["attached"])

    def unassign(self, operation: dict[str, Any]) -> dict[str, Any]:
        return {"total": self.scorer.withdraw(operation["order_id"], self.now).total}

    def is_complete(self, operation: dict[str, Any]) -> bool:
        return self.scorer.is_complete(operation["order_id"])

    def score(self, operation: dict[str, Any]) -> dict[str, Any]:
        return game_score(self.scorer.game_score(self.now))

    def name(self, operation: dict[str, Any]) -> dict[str, str]:
        return {"trimmed": trimmed_name(operation["name"]), "type": part_type(operation["name"])}


def test_recorded_cases_are_complete() -> None:
    assert len(CASES) >= 111


def check(case: dict[str, Any]) -> None:
    player = Player(case)
    for operation in case["ops"]:
        answer = player.play(operation)
        if "expect" in operation:
            assert operation["expect"] == answer, operation


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["name"])
def test_scorer_agrees_with_recorded_case(case: dict[str, Any]) -> None:
    check(case)


@pytest.mark.parametrize("case", WITHDRAWALS, ids=lambda case: case["name"])
def test_scorer_agrees_with_rule_for_withdrawn_orders(case: dict[str, Any]) -> None:
    check(case)
