"""The end of the belt, in the running cell."""

import pytest

from cellwright.cell.devices.conveyor import DeletionWall
from cellwright.cell.model.parts import PART_TYPES, part_type
from cellwright.util.errors import CellwrightError
from cellwright.util.pose import Pose
from tests.cell.devices.floor import MM, Floor, named
from tests.support.places import BELT_SURFACE

FRONT = -4.05
"""Face of the wall towards the belt: y in the world frame [m]."""


def is_gone(floor: Floor, name: str) -> bool:
    return name not in floor.cell.parts.in_play


@pytest.mark.slow
@pytest.mark.parametrize("kind", PART_TYPES)
def test_part_that_reaches_wall_is_moved_to_shelf(floor: Floor, kind: str) -> None:
    name = named(kind)
    floor.lay(name, 1.21, -3.7, BELT_SURFACE)
    floor.cell.conveyors["belt"].set_power(100.0)
    duration = floor.run_until(lambda: is_gone(floor, name), 2.0)
    front = min(-part_type(kind).box[0][1], 0.2)  # its extent ahead of its origin [m]
    reached = (-3.7 - FRONT - front) / 0.2
    assert reached - 0.01 < duration < reached + 0.25
    floor.run(2.0)
    shelf = floor.part(name).shelf
    assert floor.pose(name).position == pytest.approx(shelf.position, abs=0.3 * MM)
    assert floor.asleep(floor.part(name).body)
    assert is_gone(floor, name)


@pytest.mark.parametrize(("clearance", "gone"), [(-0.5 * MM, True), (0.5 * MM, False)])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_wall_removes_only_touching_parts(floor: Floor, side: float, clearance: float, gone: bool) -> None:
    name = named("gear_part")
    floor.lay(name, 1.21, -4.1 + side * (0.05 + 0.0392 + clearance), BELT_SURFACE)
    floor.run(0.45)
    assert is_gone(floor, name) is gone


def test_wall_checks_five_times_per_second(floor: Floor) -> None:
    floor.run(0.3)
    name = named("gear_part")
    floor.lay(name, 1.21, -4.1, BELT_SURFACE)
    assert floor.run_until(lambda: is_gone(floor, name), 0.2) == pytest.approx(0.1)


def test_wall_removes_several_parts_in_one_check(floor: Floor) -> None:
    names = [named("gear_part"), named("disk_part"), named("part2")]
    for k, name in enumerate(names):
        floor.lay(name, 1.0 + 0.2 * k, -4.1, BELT_SURFACE)
    floor.run(0.21)
    assert all(is_gone(floor, name) for name in names)
    floor.run(1.0)
    for name in names:
        assert floor.pose(name).position == pytest.approx(floor.part(name).shelf.position, abs=0.3 * MM)


def test_part_beside_below_or_above_wall_stays(floor: Floor) -> None:
    floor.lay(named("gear_part"), 0.6, -4.1, 0.0)
    floor.place(named("disk_part"), Pose((1.2, -4.1, 2.2)))
    floor.run(0.2)
    assert not is_gone(floor, named("gear_part"))
    assert not is_gone(floor, named("disk_part"))  # at 0.2 s it is still above
    floor.run(0.4)
    assert is_gone(floor, named("disk_part"))


def test_removed_part_can_be_placed_again(floor: Floor) -> None:
    name = named("gear_part")
    floor.lay(name, 1.21, -4.1, BELT_SURFACE)
    floor.run(0.3)
    assert is_gone(floor, name)
    floor.lay(name, 1.21, 3.0, BELT_SURFACE)
    floor.run(0.5)
    assert not is_gone(floor, name)
    assert floor.pose(name).position[1] == pytest.approx(3.0, abs=1e-5)


def test_unknown_event_is_refused(floor: Floor) -> None:
    wall: DeletionWall = floor.cell.deletion_walls["belt"]
    with pytest.raises(CellwrightError, match="does not know the event 'fall'"):
        wall.handle("fall", ())
