"""Number of the bodies for clones of the belt."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.model.clones import clone_name, first_bodies, more_bodies
from cellwright.config.trial.trial import BeltPart, Kit, KitObject, Options, Order, Trial
from cellwright.util.pose import Pose

RIDE = 9.1 / 0.2
"""Time from the place of appearance to the deletion wall at full power [s]."""


def belt(*parts: tuple[float, str], cycles: int = 100, wanted: tuple[str, ...] = ()) -> Trial:
    kit = Kit("order_0_kit_0", tuple(KitObject(kind, Pose()) for kind in wanted))
    return Trial(
        "belt",
        options=Options(belt_population_cycles=cycles),
        belt_parts=tuple(BeltPart(time, kind, Pose()) for time, kind in parts),
        orders=(Order("order_0", (kit,)),),
    )


@pytest.mark.parametrize("period", [1.0, 10.0, 30.0, 46.0, 100.0])
def test_first_bodies_are_those_riding_and_a_free_one(period: float) -> None:
    assert len(first_bodies(belt((period, "gear_part")))) == int(RIDE / period) + 2


def test_first_bodies_include_parts_of_a_kit() -> None:
    trial = belt((50.0, "gear_part"), (60.0, "disk_part"), wanted=("gear_part", "gear_part", "part2"))
    assert first_bodies(trial) == ("gear_part",) * 4 + ("disk_part",) * 2


def test_first_bodies_are_no_more_than_clones() -> None:
    trial = belt((1.0, "gear_part"), (2.0, "gear_part"), (3.0, "disk_part"), cycles=2)
    assert first_bodies(trial) == ("gear_part",) * 4 + ("disk_part",) * 2
    assert first_bodies(replace(trial, options=Options(belt_population_cycles=0))) == ()
    assert first_bodies(Trial("empty")) == ()


@given(st.lists(st.tuples(st.floats(0.0, 60.0), st.sampled_from(["gear_part", "part2"])), min_size=1, max_size=8))
def test_first_bodies_are_enough_for_a_belt_that_runs_on(parts: list[tuple[float, str]]) -> None:
    trial = belt(*parts, cycles=5)
    period, bodies = max(time for time, _ in parts), first_bodies(trial)
    times = sorted((turn * period + time, kind) for turn in range(5) for time, kind in parts)
    for kind in {kind for _, kind in parts}:
        its = [time for time, each in times if each == kind]
        riding = max(sum(time - RIDE < other <= time for other in its) for time in its)
        assert bodies.count(kind) == min(len(its), riding + 1)


def test_more_bodies_are_twice_as_many_up_to_the_pool() -> None:
    assert more_bodies(("a", "b", "b"), "b", 9) == ("a", "b", "b", "b", "b")
    assert more_bodies(("a", "b", "b"), "b", 3) == ("a", "b", "b", "b")
    assert more_bodies(("a", "b", "b"), "b", 2) == ("a", "b", "b")


def test_clone_name_has_its_origin() -> None:
    assert clone_name("gear_part_clone_0") == "populate_conveyor|gear_part_clone_0"
