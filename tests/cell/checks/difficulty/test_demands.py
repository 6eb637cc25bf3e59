"""Difficulties of a trial."""

from dataclasses import replace

import pytest

from cellwright.cell.checks.difficulty import PartSupply, difficulties, ordered_types, supply
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial


def trial(name: str) -> Trial:
    return load_trial([find_trial(name)]).trial


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("final01", []),
        ("final02", [("turned_over", "pulley_part to be turned over")]),
        (
            "final04",
            [
                ("several_kits", "2 equal kits"),
                ("belt_only", "gear_part only on the belt"),
                ("faulty", "1 of 9 piston_rod_part faulty"),
                ("faulty", "1 of 9 disk_part faulty"),
                ("no_spare", "no pulley_part to spare"),
            ],
        ),
        (
            "final08",
            [
                ("several_kits", "2 equal kits"),
                ("no_spare", "no pulley_part to spare"),
                ("dropped_on_tray", "pulley_part dropped over AGV 1, onto the tray"),
                ("dropped_in_reach", "disk_part dropped over bin 7, onto bin 7"),
                ("dropped_out_of_reach", "gear_part dropped over AGV 2, out of reach"),
            ],
        ),
        ("qual1b", [("dropped_out_of_reach", "piston_rod_part dropped over AGV 1 and AGV 2, out of reach")]),
        ("final13", [("interrupt", "order_1 is announced when 2 parts that it wants are on a tray")]),
        ("final11", [("interrupt", "order_1 is announced when 2 parts that it does not want are on a tray")]),
        ("lesson", [("off_tray", "4 of 4 ordered places lie off the tray")]),
    ],
)
def test_difficulties_of_public_trials(name: str, expected: list[tuple[str, str]]) -> None:
    assert sorted((each.kind, each.text) for each in difficulties(trial(name))) == sorted(expected)


def test_supply_counts_lying_belt_and_faulty_parts() -> None:
    assert supply(trial("final05"), "gasket_part") == PartSupply(lying=9, belt=8, faulty=2)
    assert supply(trial("final05"), "gasket_part").good == 15
    assert supply(trial("final01"), "gasket_part") == PartSupply(0, 0, 0)


def test_supply_counts_faulty_belt_parts() -> None:
    marked = replace(trial("final12"), faulty_parts=frozenset({"gear_part_clone_3", "gear_part_clone_4"}))
    assert supply(marked, "gear_part") == PartSupply(lying=0, belt=4, faulty=1)


def test_missing_parts_are_difficulty_short() -> None:
    few = replace(trial("final01"), bin_parts=())
    assert [(each.kind, each.text) for each in difficulties(few)] == [
        ("short", "0 good piston_rod_part for the 1 ordered"),
        ("short", "0 good gear_part for the 1 ordered"),
    ]


def test_late_or_unannounced_orders_are_difficulties() -> None:
    first, second = trial("final13").orders
    late = replace(second, wanted_parts=None, start_time=30.0)
    assert "order_1 is announced after 30 s" in [
        each.text for each in difficulties(replace(trial("final13"), orders=(first, late)))
    ]
    never = replace(second, wanted_parts=None)
    found = {each.kind: each.text for each in difficulties(replace(trial("final13"), orders=(first, never)))}
    assert found["never_announced"] == "order_1 is never announced"


def test_drop_of_unordered_parts_is_no_difficulty() -> None:
    other = trial("final09")
    regions = tuple(replace(region, type="part1") for region in other.drop_regions)
    assert difficulties(replace(other, drop_regions=regions)) == ()


def test_ordered_types_are_in_order_of_first_mention() -> None:
    assert list(ordered_types(trial("final04")).items()) == [
        ("gear_part", 2),
        ("pulley_part", 2),
        ("piston_rod_part", 2),
        ("disk_part", 2),
    ]
