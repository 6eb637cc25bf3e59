"""Attainable points: an upper bound, and the reasons."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.kitting.attainable import attainable_score, good_parts, nearest, off_plate
from cellwright.cell.kitting.kit_score import MAX_DISTANCE
from cellwright.cell.model.parts import PART_TYPES, part_type
from cellwright.config.footprints import PART_RADII
from cellwright.config.footprints import PART_TYPES as LAID_OUT
from cellwright.config.layout.layout import Tray
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import BeltPart, Kit, KitObject, Options, Order, Part, Trial
from cellwright.util.pose import Pose
from tests.cell.kitting.builders import kit, order, ordered, pose
from tests.support.places import LAYOUT, TRAY_PLATE

GEARS = tuple(Part(f"bin5|gear_part_{n}", "gear_part", Pose()) for n in (1, 2))


def trial(*orders: Order, **more: object) -> Trial:
    return Trial("t", orders=orders, bin_parts=GEARS, **more)  # type: ignore[arg-type]


def test_lesson_has_two_thirds_of_points_attainable() -> None:
    bound = attainable_score(load_trial([find_trial("lesson")]).trial)
    assert (bound.total, bound.maximum) == (8.0, 12.0)
    (found,) = bound.orders[0].kits
    assert (found.part_presence, found.all_parts_bonus, found.part_pose) == (4.0, 4.0, 0.0)
    assert [part.off_plate for part in found.parts] == pytest.approx([0.49, 0.49, 0.48, 0.49])
    assert [part.nearest for part in found.parts] == pytest.approx([0.351, 0.351, 0.422, 0.432])
    assert bound.sentence() == (
        "at most 8 of 12 points are attainable: order_0_kit_0: 4 of 4 places lie 0.48 to 0.49 m off the tray, "
        "at least 351 mm from any part on it"
    )
    assert len(list(found.reasons())) == 4
    assert next(found.reasons()).startswith("part 1, piston_rod_part: its place (0.74, 0.05) lies 0.49 m off the tray")


def test_order_with_supply_and_places_on_tray_is_fully_attainable() -> None:
    bound = attainable_score(trial(order(types=("gear_part", "gear_part"), start_time=0.0)))
    assert (bound.total, bound.maximum, bound.sentence()) == (6.0, 6.0, "")
    assert list(bound.kit("order_0_kit_0").reasons()) == []


def test_place_is_off_tray_only_if_no_part_can_touch_plate() -> None:
    edge, radius = TRAY_PLATE[0] / 2, PART_RADII["gear_part"]
    inside, outside = edge + radius + MAX_DISTANCE - 1e-6, edge + radius + MAX_DISTANCE + 1e-6
    assert (
        nearest("gear_part", pose(x=inside), TRAY_PLATE)
        <= MAX_DISTANCE
        < nearest("gear_part", pose(x=-outside), TRAY_PLATE)
    )
    assert nearest("an unknown type", pose(x=9.0), TRAY_PLATE) == 0.0  # unknown size


def test_kit_is_measured_against_the_trays_that_it_may_be_built_on() -> None:
    small, large = (Tray(n, f"tray{n}", Pose(), (edge, edge)) for n, edge in ((3, 0.2), (4, 1.0)))
    layout = replace(LAYOUT, carriers=(), trays=(small, large))
    there = KitObject("gear_part", pose(x=0.4))
    kits = [Kit(f"k{n}", (there,), tray) for n, tray in enumerate((None, "tray4", "tray3"))]
    bound = attainable_score(trial(Order("order_0", tuple(kits), start_time=0.0), layout=layout))
    assert [kit.part_pose for kit in bound.orders[0].kits] == [1.0, 1.0, 0.0]
    assert [kit.parts[0].plate for kit in bound.orders[0].kits] == [(1.0, 1.0), (1.0, 1.0), (0.2, 0.2)]
    (sentence,) = bound.orders[0].kits[2].reasons()
    assert "lies 0.30 m off the tray (0.2 x 0.2 m)" in sentence


def test_cell_without_trays_has_an_obstacle_and_no_place_off_a_tray() -> None:
    bound = attainable_score(trial(order(types=("gear_part",), start_time=0.0), layout=replace(LAYOUT, carriers=())))
    (kit,) = bound.orders[0].kits
    assert (kit.total, kit.obstacle, kit.parts[0].off_plate) == (0.0, "the cell has no AGV and no tray", 0.0)


def test_type_in_short_supply_costs_points_and_bonus() -> None:
    bound = attainable_score(trial(order(types=("gear_part", "gear_part", "gear_part"), start_time=0.0)))
    assert (bound.total, bound.orders[0].total) == (4.0, 4.0)
    assert bound.sentence().endswith("order_0_kit_0: the cell has 1 good gear_part too few")
    assert list(bound.kit("order_0_kit_0").reasons()) == [
        "part 3, gear_part: the cell has too few good parts of type gear_part"
    ]


def test_faulty_parts_are_not_supply() -> None:
    belt = (BeltPart(1.0, "disk_part", Pose()), BeltPart(2.0, "disk_part", Pose()))
    whole = trial(belt_parts=belt, options=Options(belt_population_cycles=3))
    assert good_parts(whole) == {"gear_part": 2, "disk_part": 6}
    bad = replace(whole, faulty_parts=frozenset({"gear_part_2", "disk_part_clone_5", "disk_part_clone_6"}))
    assert good_parts(bad) == {"gear_part": 1, "disk_part": 5}
    demo = replace(trial(order(types=("part4",), start_time=0.0)), options=Options(fill_demo_tray=True))
    assert good_parts(demo)["part4"] == 1


def test_order_that_is_never_announced_has_no_attainable_points() -> None:
    first, late, behind = order(0, start_time=0.0), order(1, start_time=50.0), order(2, wanted_parts=1)
    bound = attainable_score(trial(first, late, behind, time_limit=40.0))
    assert [each.total for each in bound.orders] == [3.0, 0.0, 0.0]
    reasons = list(bound.kit("order_2_kit_0").reasons())
    assert reasons == ["order_1 is due at 50 s, after the time limit of 40 s"]  # it waits for the one before
    assert attainable_score(trial(first, late, behind, time_limit=None)).total == 9.0
    assert "no condition announces order_3" in attainable_score(trial(order(3))).sentence()
    assert attainable_score(trial(order(3, unwanted_parts=1))).total == 3.0


def test_cell_without_agvs_has_no_attainable_points() -> None:
    bound = attainable_score(trial(order(start_time=0.0), options=Options(insert_agvs=False)))
    assert (bound.total, bound.maximum) == (0.0, 3.0)
    assert "no AGV" in bound.sentence()


def test_unknown_kit_raises_key_error() -> None:
    with pytest.raises(KeyError):
        attainable_score(trial()).kit("order_9_kit_9")


@pytest.mark.parametrize("name", PART_TYPES)
def test_part_radii_enclose_built_parts(name: str) -> None:
    lower, upper = part_type(name).box
    farthest = math.hypot(*(max(abs(low), abs(high)) for low, high in zip(lower, upper, strict=True)))
    assert farthest <= PART_RADII[name] < farthest + 0.001


def test_every_part_type_has_radius() -> None:
    assert set(PART_RADII) == set(LAID_OUT)


@given(st.floats(-2, 2), st.floats(-2, 2))
def test_off_plate_is_distance_to_nearest_point(x: float, y: float) -> None:
    near = max(-0.25, min(0.25, x)), max(-0.35, min(0.35, y))
    assert off_plate(pose(x, y), TRAY_PLATE) == pytest.approx(math.dist((x, y), near), abs=1e-12)


@given(st.lists(st.tuples(st.sampled_from(["gear_part", "disk_part"]), st.floats(-1, 1)), max_size=5))
def test_attainable_total_never_exceeds_maximum(parts: list[tuple[str, float]]) -> None:
    ordered_kit = kit(*(ordered(type_, x) for type_, x in parts))
    bound = attainable_score(trial(Order("order_0", (ordered_kit,), start_time=0.0)))
    assert 0.0 <= bound.total <= bound.maximum == 3.0 * len(parts)
    assert bool(bound.sentence()) is (bound.total < bound.maximum)
