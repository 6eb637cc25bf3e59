"""Belt under parts, in the running cell."""

import numpy as np
import pytest
from numpy.typing import NDArray

from cellwright.cell.devices.conveyor import Conveyor
from cellwright.cell.model.parts import PART_TYPES
from cellwright.engine.snapshot import restore_snapshot, take_snapshot
from tests.cell.devices.floor import MM, Floor, named, one_of_each
from tests.support.places import BELT_SPEED, BELT_SURFACE


@pytest.fixture(scope="module")
def shared() -> Floor:
    return Floor(one_of_each(has_arm=False))


@pytest.fixture
def floor(shared: Floor) -> Floor:
    """One part of each type, asleep on the standing belt."""
    shared.reset()
    for k, kind in enumerate(PART_TYPES):
        shared.lay(named(kind), 1.21, 6.0 - 0.5 * k, BELT_SURFACE)
    shared.run(0.5)
    assert all(shared.asleep(shared.part(named(kind)).body) for kind in PART_TYPES)
    return shared


def places(floor: Floor) -> NDArray[np.float64]:
    return np.array([floor.pose(named(kind)).position for kind in PART_TYPES])


def speeds(floor: Floor) -> NDArray[np.float64]:
    """Return the speed of each part in the belt's direction [m/s]."""
    return np.array([-floor.velocity(named(kind))[1] for kind in PART_TYPES])


@pytest.mark.slow
@pytest.mark.parametrize("power", [100.0, 50.0, 33.3, 1.0, 0.3, 0.1])
def test_parts_move_at_belt_speed(floor: Floor, power: float) -> None:
    assert floor.cell.conveyors["belt"].set_power(power)
    floor.run(0.2)
    before = places(floor)
    floor.run(3.0)
    travelled = before - places(floor)
    expected = 0.2 * power / 100.0 * 3.0
    assert np.abs(travelled[:, 1] / expected - 1.0).max() < 1e-4
    assert np.abs(travelled[:, [0, 2]]).max() < 0.01 * MM


@pytest.mark.parametrize("power", [100.0, 20.0])
def test_belt_starts_and_stops_within_50_ms(floor: Floor, power: float) -> None:
    speed = BELT_SPEED * power / 100.0
    floor.cell.conveyors["belt"].set_power(power)
    floor.run(0.05)
    assert np.abs(speeds(floor) - speed).max() < 0.01 * speed
    floor.run(1.0)
    floor.cell.conveyors["belt"].set_power(0.0)
    floor.run(0.05)
    assert np.abs(speeds(floor)).max() < 0.01 * speed


def test_sleeping_parts_wake_when_belt_starts(floor: Floor) -> None:
    for _ in range(2):
        floor.cell.conveyors["belt"].set_power(100.0)
        before = places(floor)
        floor.run(0.5)
        assert (before - places(floor))[:, 1].min() > 0.095
        floor.cell.conveyors["belt"].set_power(0.0)
        floor.run(1.0)
        assert all(floor.asleep(floor.part(named(kind)).body) for kind in PART_TYPES)


@pytest.mark.parametrize("power", [-1.0, -1e-9, 100.001, float("nan"), float("inf"), -float("inf")])
def test_power_outside_range_is_ignored(floor: Floor, power: float) -> None:
    conveyor = floor.cell.conveyors["belt"]
    powers: list[float] = []

    def listen(device: Conveyor) -> None:
        powers.append(device.power)

    conveyor.on_power.append(listen)
    try:
        assert conveyor.set_power(40.0)
        assert not conveyor.set_power(power)
    finally:
        conveyor.on_power.remove(listen)
    assert powers == [40.0]
    assert conveyor.power == 40.0
    floor.run(0.3)
    assert speeds(floor) == pytest.approx(0.08, rel=0.01)


def test_parts_in_bins_stay_asleep_while_belt_runs(floor: Floor) -> None:
    floor.lay(named("gear_part"), -0.3, 0.23, 0.725)
    floor.run(0.5)
    floor.cell.conveyors["belt"].set_power(100.0)
    floor.cell.step()
    assert floor.asleep(floor.part(named("gear_part")).body)


def test_reset_stops_belt(floor: Floor) -> None:
    fresh = floor.cell.state_hash()
    floor.cell.conveyors["belt"].set_power(0.2)
    floor.run(0.1)
    floor.reset()
    first = floor.cell.state_hash()
    assert first == Floor(one_of_each(has_arm=False)).cell.state_hash() != fresh
    floor.lay(named("gear_part"), 1.21, 5.0, BELT_SURFACE)
    floor.run(0.5)
    assert floor.pose(named("gear_part")).position[1] == pytest.approx(5.0, abs=1e-5)


@pytest.mark.parametrize("power", [80.0, 0.2])
def test_snapshot_restores_belt_power(floor: Floor, power: float) -> None:
    floor.cell.conveyors["belt"].set_power(power)
    floor.run(0.3)
    snapshot = take_snapshot(floor.simulation)
    floor.run(0.5)
    expected = floor.cell.state_hash()
    floor.cell.conveyors["belt"].set_power(0.0)
    floor.run(0.2)
    restore_snapshot(floor.simulation, snapshot)
    assert floor.cell.conveyors["belt"].power == power
    floor.run(0.5)
    assert floor.cell.state_hash() == expected
