"""Parts that appear on the belt, in the running cell."""

import math

import pytest

from cellwright.cell.devices.conveyor import Population
from cellwright.config.trial.trial import BeltPart, Options, Trial
from cellwright.engine.snapshot import restore_snapshot, take_snapshot
from cellwright.util.errors import CellwrightError
from cellwright.util.pose import Pose
from tests.cell.devices.floor import MM, Floor

ABOVE_BELT = Pose((0.0, 0.0, 0.1))
# written out of order; two at one time
LIST = (
    BeltPart(1.5, "disk_part", Pose.from_rpy((0.0, 0.1, 0.1), (0.0, 0.0, 0.5))),
    BeltPart(0.5, "gear_part", ABOVE_BELT),
    BeltPart(1.0, "gear_part", Pose((0.0, -0.2, 0.1))),
    BeltPart(1.0, "gear_part", Pose((0.0, 0.2, 0.1))),
)


@pytest.fixture(scope="module")
def shared() -> Floor:
    return Floor(Trial("population", belt_parts=LIST, options=Options(belt_population_cycles=2)))


def population(floor: Floor) -> Population:
    return floor.cell.populations["belt"]


def start(floor: Floor) -> None:
    """Start the list, as the competition does."""
    floor.cell.conveyors["belt"].set_power(100.0)
    population(floor).control("restart")


def appearances(floor: Floor, seconds: float) -> list[tuple[int, str]]:
    """Return time [ms] and short name of each part that appears meanwhile."""
    found = []
    end = floor.now + seconds
    known = set(floor.cell.parts.in_play)
    while floor.now < end - 1e-9:
        floor.cell.step()
        new = sorted(floor.cell.parts.in_play - known)
        found += [(round(floor.now * 1e3), name.removeprefix("populate_conveyor|")) for name in new]
        known |= floor.cell.parts.in_play
    return found


def test_cell_without_belt_parts_has_no_population() -> None:
    assert Floor(Trial("none")).cell.populations == {}


def test_no_part_appears_before_start(floor: Floor) -> None:
    floor.cell.conveyors["belt"].set_power(100.0)
    assert not population(floor).running
    assert appearances(floor, 2.0) == []


def test_due_parts_appear_one_per_step_until_pool_is_empty(floor: Floor) -> None:
    start(floor)
    assert population(floor).running
    assert appearances(floor, 8.0) == [
        (500, "gear_part_clone_0"),
        (1000, "gear_part_clone_1"),
        (1002, "gear_part_clone_2"),
        (1500, "disk_part_clone_0"),
        (2000, "gear_part_clone_3"),
        (2500, "gear_part_clone_4"),
        (2502, "gear_part_clone_5"),
        (3000, "disk_part_clone_1"),
    ]
    assert population(floor).running


def test_part_appears_in_spawn_frame(floor: Floor) -> None:
    start(floor)
    floor.run(1.5)
    disk = floor.pose("populate_conveyor|disk_part_clone_0")
    # the frame's x axis points in the belt's direction, its y axis along world x
    assert disk.position == pytest.approx((1.31, 5.0, 0.9126), abs=1e-5)
    _, _, yaw = disk.rpy
    assert yaw == pytest.approx(0.5 - math.pi / 2, abs=1e-4)


def test_new_part_falls_onto_belt_and_moves_with_it(floor: Floor) -> None:
    start(floor)
    floor.run(2.5)
    first = floor.pose("populate_conveyor|gear_part_clone_0").position
    assert first[0] == pytest.approx(1.21, abs=0.1 * MM)
    assert first[1] == pytest.approx(5.0 - 0.2 * 2.0, abs=15 * MM)
    assert first[2] == pytest.approx(0.90691 + 0.0001, abs=0.05 * MM)


@pytest.mark.parametrize(("power", "times"), [(50.0, [1000, 2000]), (25.0, [2000, 4000])])
def test_slower_belt_delays_appearances(floor: Floor, power: float, times: list[int]) -> None:
    start(floor)
    floor.cell.conveyors["belt"].set_power(power)
    assert [time for time, _ in appearances(floor, times[1] / 1e3)] == times


def test_stopped_belt_pauses_appearances(floor: Floor) -> None:
    start(floor)
    floor.run(0.4)
    floor.cell.conveyors["belt"].set_power(0.0)
    assert appearances(floor, 3.0) == []
    floor.cell.conveyors["belt"].set_power(100.0)
    assert appearances(floor, 0.2) == [(3500, "gear_part_clone_0")]


def test_pause_resume_and_restart_control_appearances(floor: Floor) -> None:
    start(floor)
    floor.run(0.7)
    population(floor).control("pause")
    assert not population(floor).running
    assert appearances(floor, 2.0) == []
    population(floor).control("resume")
    assert population(floor).running
    assert appearances(floor, 0.4) == [(3000, "gear_part_clone_1"), (3002, "gear_part_clone_2")]
    population(floor).control("restart")
    assert appearances(floor, 0.6) == [(3600, "gear_part_clone_3")]


def test_unknown_event_is_refused(floor: Floor) -> None:
    with pytest.raises(CellwrightError, match="does not know the event 'vanish'"):
        population(floor).handle("vanish", ())


def test_reset_and_snapshot_repeat_appearances(floor: Floor) -> None:
    hashes, seen = [], []
    for _ in range(2):
        start(floor.reset())
        floor.run(1.2)
        snapshot = take_snapshot(floor.simulation)
        seen.append(appearances(floor, 3.0))
        hashes.append(floor.cell.state_hash())
        restore_snapshot(floor.simulation, snapshot)
        seen.append(appearances(floor, 3.0))
        hashes.append(floor.cell.state_hash())
    assert len(seen[0]) == 5
    assert all(each == seen[0] for each in seen)
    assert len(set(hashes)) == 1
