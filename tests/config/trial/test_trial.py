"""Names of the parts that appear later: on the belt, and on the demo tray."""

from dataclasses import replace

from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import BeltPart, Kit, KitObject, Options, Order, Trial
from cellwright.util.pose import Pose

BELT = tuple(
    BeltPart(time, kind, Pose()) for time, kind in ((1.0, "gear_part"), (2.0, "disk_part"), (3.0, "gear_part"))
)
OBJECTS = tuple(KitObject(kind, Pose((x, 0.0, 0.0))) for x, kind in enumerate(("gear_part", "no_part", "gear_part")))
FULL = Trial(
    "full",
    options=Options(fill_demo_tray=True, belt_population_cycles=2),
    belt_parts=BELT,
    orders=(Order("order_0", (Kit("order_0_kit_0", OBJECTS), Kit("order_0_kit_1", OBJECTS))),),
)


def test_belt_clones_are_named_type_by_type() -> None:
    gears = [(f"gear_part_clone_{k}", "gear_part") for k in range(4)]
    assert FULL.belt_clones() == (*gears, ("disk_part_clone_0", "disk_part"), ("disk_part_clone_1", "disk_part"))
    assert replace(FULL, options=Options(belt_population_cycles=0)).belt_clones() == ()


def test_demo_clones_are_first_kit_without_unknown_types() -> None:
    assert FULL.demo_clones() == (("gear_part_clone_0", OBJECTS[0]), ("gear_part_clone_1", OBJECTS[2]))


def test_demo_clones_without_option_or_kit_are_empty() -> None:
    for options in (Options(), Options(fill_demo_tray=True, insert_agvs=False)):
        assert replace(FULL, options=options).demo_clones() == ()
    assert replace(FULL, orders=()).demo_clones() == ()
    assert replace(FULL, orders=(Order("order_0", ()),)).demo_clones() == ()


def test_faulty_part_missing_on_demo_tray_is_warning() -> None:
    parts = "parts: {a: {type: gear_part, pose: {}}, b: {type: disk_part, pose: {}}}"
    order = f"order_0: {{announcement_condition: time, announcement_condition_value: 0, {parts}}}"
    text = (
        f"options: {{fill_demo_tray: true}}\norders: {{{order}}}\nfaulty_parts: [gear_part_clone_0, gear_part_clone_1]"
    )
    (warning,) = load_trial(text=text).warnings
    assert "no part is called 'gear_part_clone_1'; did you mean gear_part_clone_0" in str(warning)


def test_order_comparison_ignores_written_values() -> None:
    written = "orders: {a: {announcement_condition: time, announcement_condition_value: 1, parts: {}}}"
    (order,) = load_trial(text=written).trial.orders
    assert (order.written, "written" in repr(order)) == (("time", 1), False)
    assert order == replace(order, written=None)
