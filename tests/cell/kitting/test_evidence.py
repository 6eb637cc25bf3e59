"""The evidence: a sentence with figures for every point, won or lost, judged or not."""

from __future__ import annotations

import json
import math

import pytest

from cellwright.cell.kitting.evidence import (
    MAX_TILT,
    Evidence,
    KitEvidence,
    evidence,
    evidence_to_json,
    kit_evidence,
    kit_to_json,
    trial_score_to_json,
)
from cellwright.cell.kitting.fates import Fate, FateKind
from cellwright.cell.kitting.inventory import TrayObject
from cellwright.cell.kitting.scorer import Averages, Scorer, trial_score
from cellwright.config.sensors import SensorConfig
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Order, Part, Trial
from cellwright.util.pose import Pose
from tests.cell.kitting.builders import kit, order, ordered, pose, tray_object

SECOND = 1_000_000_000
KINDS = ("gear_part", "disk_part", "pulley_part")
CELL = tuple(Part(f"bin5|{kind}_{n}", kind, Pose()) for kind in KINDS for n in range(9))


def judged(*contents: TrayObject, first: Order, more: tuple[Order, ...] = ()) -> Evidence:
    """Return the evidence after a tray was submitted as the first kit of an order, 10 s after the start."""
    orders = (first, *more)
    scorer = Scorer(orders)
    scorer.begin(0)
    scorer.announce(first.order_id, 0)
    scorer.submit(first.kits[0].kit_type, contents, 10 * SECOND)
    sensors = (SensorConfig("a", "logical_camera", Pose()), SensorConfig("b", "break_beam", Pose()))
    trial = Trial("t", orders=orders, bin_parts=CELL, sensors=sensors)
    return evidence(trial, scorer.game_score(12 * SECOND), 12 * SECOND)


def kits_of(found: Evidence) -> list[KitEvidence]:
    return [kit for order in found.orders for kit in order.kits]


def sentences(found: Evidence) -> list[str]:
    return [part.sentence() for kit in kits_of(found) for part in kit.parts]


def sentence_of(found: TrayObject, x: float = 0.0) -> str:
    first = Order("order_0", (kit(ordered("gear_part", x)),), start_time=0.0)
    (sentence,) = sentences(judged(found, first=first))
    return sentence


def test_sentence_of_each_verdict_has_measured_values() -> None:
    assert (
        sentence_of(tray_object(x=0.012, yaw=0.05)) == "bin5|gear_part_1 lies in its place, off by 12.0 mm and 50 mrad"
    )
    assert sentence_of(tray_object(x=0.0425)) == "bin5|gear_part_1 lies 42.5 mm from its place, 12.5 mm too far"
    assert sentence_of(tray_object(yaw=0.15)) == "bin5|gear_part_1 lies turned by 150 mrad, 50 mrad too far"
    over = TrayObject("bin5|gear_part_1", "gear_part", False, pose(roll=math.pi))
    assert sentence_of(over) == "bin5|gear_part_1 lies turned over by 3142 mrad, 2506 mrad too far"
    assert sentence_of(tray_object(faulty=True)) == "only a faulty one, which does not count: bin5|gear_part_1"
    assert sentence_of(tray_object("disk_part")) == "not on the tray at submission"
    assert math.degrees(MAX_TILT) == pytest.approx(36.4, abs=0.05)


def test_place_off_tray_is_distinct_from_bad_placement() -> None:
    sentence = sentence_of(tray_object(x=0.2), x=0.74)
    assert sentence == (
        "bin5|gear_part_1 lies 540.0 mm from its place, 510.0 mm too far; its place (0.74, 0) lies 0.49 m off the "
        "tray (0.5 x 0.7 m), at least 432 mm from any part on it (at most 30 mm are allowed)"
    )
    first = Order("order_0", (kit(ordered("gear_part", 0.74)),), start_time=0.0)
    found = judged(tray_object(x=0.2), first=first)
    assert [part.cause for each in kits_of(found) for part in each.parts] == ["off tray"]
    assert (found.total, found.attainable.total, found.attainable.maximum) == (2.0, 2.0, 3.0)


def test_parts_of_unjudged_kits_are_listed() -> None:
    found = judged(tray_object(), first=order(0, kits=2, start_time=0.0), more=(order(1, KINDS, start_time=99.0),))
    causes = [(each.score.kit_type, [part.cause for part in each.parts]) for each in kits_of(found)]
    assert causes == [
        ("order_0_kit_0", ["placed"]),
        ("order_0_kit_1", ["not submitted"]),
        ("order_1_kit_0", ["not announced"] * 3),
    ]
    assert sentences(found)[1:3] == ["its kit was never submitted", "its order was never announced"]
    assert [each.bonus_sentence for each in kits_of(found)] == [
        "the tray held exactly what was ordered",
        "its kit was never submitted",
        "its order was never announced",
    ]
    assert [each.is_announced for each in found.orders] == [True, False]


def test_missing_bonus_has_reason() -> None:
    first = order(0, start_time=0.0)
    short, besides = judged(first=first), judged(tray_object(), tray_object("disk_part"), first=first)
    assert [each.bonus_sentence for each in kits_of(short)] == ["an ordered part is missing, so there is no bonus"]
    assert [each.bonus_sentence for each in kits_of(besides)] == [
        "the tray holds more than was ordered, so there is no bonus"
    ]


def test_points_in_evidence_equal_referee_score() -> None:
    first = order(0, KINDS, start_time=0.0)
    found = judged(tray_object(), tray_object("disk_part", x=0.1), first=first)
    (each,) = kits_of(found)
    assert sum(part.presence for part in each.parts) == each.score.part_presence == 2.0
    assert sum(part.pose for part in each.parts) == each.score.part_pose == 2.0
    assert found.total == each.score.total == 4.0


def test_json_has_times_costs_and_values_in_si_units() -> None:
    found = judged(tray_object(x=0.04, yaw=0.05), first=order(0, start_time=0.0), more=(order(1, start_time=99.0),))
    document = json.loads(json.dumps(evidence_to_json(found)))
    assert (document["total"], document["reachable"], document["best"]) == (2.0, 6.0, 6.0)
    assert (document["process_time"], document["part_travel_time"], document["system_cost"]) == (12.0, 0.0, 600.0)
    first, second = document["orders"]
    assert (first["time_taken"], first["complete"], first["announced"]) == (10.0, True, True)
    assert (second["announced"], second["kits"][0]["submitted"]) == (False, False)
    (part,) = first["kits"][0]["parts"]
    assert (part["verdict"], part["object"]) == ("too far", "bin5|gear_part_1")
    assert part["distance"] == pytest.approx(0.04)
    assert part["yaw_difference"] == pytest.approx(0.05)
    assert part["turn"] == pytest.approx(0.05)
    assert part["place"] == {"position": [0, 0, 0], "quaternion": [1, 0, 0, 0], "off_plate": 0, "nearest": 0}
    assert second["kits"][0]["parts"][0]["verdict"] is None


def test_fate_of_missing_part_is_in_sentence_and_json() -> None:
    found = judged(first=order(0, start_time=0.0))
    (each,) = kits_of(found)
    fate = Fate(FateKind.DROPPED, "bin5|gear_part_1", (0.31, 2.95, 1.0), 4 * SECOND, 3 * SECOND, lies=(0.3, 2.95, 0.7))
    known = kit_evidence(each.score, each.attainable, fates=(fate,))
    (part,) = json.loads(json.dumps(kit_to_json(known)))["parts"]
    assert part["sentence"] == f"not on the tray at submission: {fate.sentence()}"
    assert part["fate"] == {
        "kind": "dropped",
        "sentence": "bin5|gear_part_1 was dropped at (0.31, 2.95) m after 3.0 s in the gripper",
        "part": "bin5|gear_part_1",
        "faulty": False,
        "position": [0.31, 2.95, 1.0],
        "time": 4.0,
        "held": 3.0,
        "lies": [0.3, 2.95, 0.7],
        "tray": None,
        "past": 0,
    }
    assert kit_to_json(each)["parts"][0]["fate"] is None


def test_trial_score_json_has_each_term() -> None:
    found = judged(tray_object(), first=order(0, start_time=0.0))
    sensors = (SensorConfig("a", "logical_camera", Pose()),)
    final = trial_score(sensors, [each.score for each in found.orders], Averages(500.0, (20.0,)))
    document = trial_score_to_json(final)
    assert (document["total"], document["cost_factor"], document["cost_points"]) == (7.5, 1.0, 1.5)
    (share,) = document["orders"]
    assert (share["efficiency"], share["efficiency_points"], share["time_taken"]) == (2.0, 6.0, 10.0)


def test_evidence_of_lesson_has_attainable_points_before_start() -> None:
    trial = load_trial([find_trial("lesson")]).trial
    document = evidence_to_json(evidence(trial, Scorer(trial.orders).game_score(0)))
    assert (document["total"], document["reachable"], document["best"]) == (0.0, 8.0, 12.0)
    assert "at most 8 of 12 points are attainable" in document["reachable_reason"]
    (found,) = document["orders"][0]["kits"]
    assert all("lies 0.4" in line and "off the tray" in line for line in found["out_of_reach"])
    assert document["system_cost"] == 1300.0
