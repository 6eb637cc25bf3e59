"""Parts in the running cell."""

import re

import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.devices.parts import Parts
from cellwright.cell.model.build import WorldPart
from cellwright.config.trial.trial import BeltPart, Trial
from cellwright.util.errors import UnknownNameError, UsageError
from cellwright.util.pose import Pose
from tests.cell.devices.floor import MM, Floor, named, one_of_each

GEAR = named("gear_part")
POOLED = "populate_conveyor|gear_part_clone_0"


@pytest.fixture(scope="module")
def shared() -> Floor:
    return Floor(one_of_each(belt_parts=(BeltPart(1.0, "gear_part", Pose((0.0, 0.0, 0.1))),)))


@pytest.fixture
def parts(floor: Floor) -> Parts:
    return floor.cell.parts


def test_part_is_found_by_name(parts: Parts) -> None:
    assert parts.part(GEAR).type == "gear_part"
    with pytest.raises(UnknownNameError, match=r"gear_part_1"):
        parts.part("floor|gear_part_2")


def test_clone_has_no_body_before_it_appears(parts: Parts) -> None:
    assert parts.in_play == {part.name for part in parts.all} == set(parts.names) - {POOLED}
    with pytest.raises(UsageError, match=f"part '{re.escape(POOLED)}' is not in play"):
        parts.part(POOLED)


def test_part_that_appears_is_in_play_at_rest(floor: Floor, parts: Parts) -> None:
    floor.run(0.5)
    (body,) = parts.world.bodies
    floor.simulation.data.qvel[body.dof : body.dof + 6] = 1.0
    there = Pose.from_rpy((-2.5, 0.0, 0.5), (0.0, 0.0, 1.0))
    parts.appear(POOLED, there)
    assert floor.pose(POOLED) == there
    assert not floor.velocity(POOLED).any()
    assert POOLED in parts.in_play
    floor.run(0.2)
    assert 0.5 - floor.pose(POOLED).position[2] == pytest.approx(0.5 * 9.81 * 0.2**2, abs=2 * MM)


def test_part_put_away_rests_on_its_shelf_slot(floor: Floor, parts: Parts) -> None:
    part = parts.part(GEAR)
    parts.put_away(part)
    assert parts.pose(part) == part.shelf
    assert GEAR not in parts.in_play
    floor.run(1.0)
    assert floor.asleep(part.body)
    assert floor.pose(GEAR).position == pytest.approx(part.shelf.position, abs=0.3 * MM)


def test_positions_have_one_row_per_part(floor: Floor, parts: Parts) -> None:
    floor.place(GEAR, Pose((0.1, 0.2, 3.0)))
    positions = parts.positions()
    assert positions.shape == (len(parts.all), 3)
    assert positions[parts.all.index(parts.part(GEAR))] == pytest.approx((0.1, 0.2, 3.0))


def test_inside_is_closed_box_of_parts_in_play(floor: Floor, parts: Parts) -> None:
    floor.place(GEAR, Pose((0.5, 0.5, 3.0)))
    lower, upper = (0.0, 0.0, 3.0), (0.5, 1.0, 4.0)
    assert parts.inside(lower, upper) == [parts.part(GEAR)]
    assert parts.inside(lower, (0.499, 1.0, 4.0)) == []
    parts.in_play.discard(GEAR)
    assert parts.inside(lower, upper) == []


def test_inside_of_cell_without_parts_is_empty() -> None:
    assert Cell(Trial("empty")).parts.inside((-1.0,) * 3, (1.0,) * 3) == []


def test_placing_releases_all_welds(floor: Floor, parts: Parts) -> None:
    part = parts.part(GEAR)
    taken: list[WorldPart] = []
    parts.on_taken.append(taken.append)
    active = floor.simulation.data.eq_active
    try:
        active[[*part.grips.values(), *part.locks.values()]] = 1
        assert parts.is_locked(part)
        parts.place(part, part.start)
    finally:
        parts.on_taken.pop()
    assert not active.any()
    assert not parts.is_locked(part)
    assert taken == [part]


def test_placed_part_has_new_pose_in_same_tick(floor: Floor) -> None:
    floor.run(0.5)
    assert floor.body_pose(GEAR) == floor.pose(GEAR)
    there = Pose((-2.0, 1.0, 0.5))
    floor.place(GEAR, there)
    assert floor.body_pose(GEAR) == there


def test_restored_state_has_parts_in_play(parts: Parts) -> None:
    state = parts.get_state()
    parts.in_play.clear()
    parts.set_state(state)
    assert GEAR in parts.in_play
