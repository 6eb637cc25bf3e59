from __future__ import annotations

import math

import numpy as np
import pytest

from cellwright.cell.devices.range_sensors import ProximityReading, ProximitySensor
from cellwright.util.pose import Pose
from tests.cell.devices.scene import add_block, empty_spec, make_simulation

POSE = Pose.from_rpy((0.95, 2.6, 0.916), (0.0, 0.0, 0.0))
SOURCE_X = 0.95 + 0.023


def facing(distance: float, half: float = 0.1, offset: float = 0.0, noise: float = 1.0) -> ProximitySensor:
    """Return a sensor with a block whose front stands `distance` before the source, `offset` to the left."""
    sensor = ProximitySensor("proximity_sensor", POSE, noise=noise)
    spec = empty_spec()
    add_block(spec, (SOURCE_X + distance + 0.1, 2.6 + offset, 0.916), (0.1, half, half))
    make_simulation(spec, sensor)
    return sensor


@pytest.mark.parametrize("distance", [0.011, 0.05, 0.1499])
def test_range_without_noise_is_exact(distance: float) -> None:
    assert facing(distance, noise=0.0).read().range == pytest.approx(distance, abs=1e-9)


@pytest.mark.parametrize("distance", [0.1501, 0.3])
def test_empty_cone_reads_maximum_range(distance: float) -> None:
    assert facing(distance).read().range == 0.15


def test_object_before_start_of_rays_is_ignored() -> None:
    sensor = ProximitySensor("proximity_sensor", POSE, noise=0.0)
    spec = empty_spec()
    add_block(spec, (SOURCE_X + 0.004, 2.6, 0.916), (0.003, 0.1, 0.1))
    add_block(spec, (SOURCE_X + 0.2, 2.6, 0.916), (0.1, 0.1, 0.1))
    make_simulation(spec, sensor)
    assert sensor.read().range == pytest.approx(0.1, abs=1e-9)


def test_cone_is_as_wide_as_outer_rays() -> None:
    reach = 0.1 * math.tan(0.0625)  # offset of the outermost ray at 0.1 m
    inside = facing(0.1, half=0.01, offset=0.01 + reach - 1e-4, noise=0.0).read().range
    assert inside == pytest.approx(0.1 / math.cos(0.0625), abs=1e-9)
    # a ray passes the front beside the block and the near end of its side still lies outside the cone
    assert facing(0.1, half=0.01, offset=0.01 + 0.15 * math.tan(0.0625) + 1e-4, noise=0.0).read().range == 0.15


def test_range_is_that_of_nearest_ray() -> None:
    sensor = ProximitySensor("proximity_sensor", POSE, noise=0.0)
    spec = empty_spec()
    add_block(spec, (SOURCE_X + 0.24, 2.6, 0.916), (0.1, 0.1, 0.1))
    add_block(spec, (SOURCE_X + 0.18, 2.6, 0.916 + 0.1), (0.1, 0.1, 0.1 - 0.06 * math.tan(0.0625)))
    make_simulation(spec, sensor)
    assert sensor.read().range == pytest.approx(0.08 / math.cos(0.0625), abs=1e-9)


def test_noise_is_unbiased_with_original_spread() -> None:
    sensor = facing(0.08)
    ranges = np.array([sensor.measure(index).range for index in range(1, 4001)])
    assert abs(ranges.mean() - 0.08) < 4 * 0.001 / math.sqrt(4000)
    assert ranges.std() == pytest.approx(0.001, rel=0.05)


def test_noise_stays_within_range() -> None:
    near, far = facing(0.0101), facing(0.1499)
    near_ranges = [near.measure(index).range for index in range(1, 200)]
    far_ranges = [far.measure(index).range for index in range(1, 200)]
    assert min(near_ranges) == 0.01
    assert max(far_ranges) == 0.15
    assert max(near_ranges) > 0.0105
    assert min(far_ranges) < 0.1495


def test_sensor_reads_twenty_times_per_second() -> None:
    sensor = facing(0.08)
    got: list[ProximityReading] = []
    sensor.listen(got.append)
    sensor.simulation.step_until(10**9)
    assert [reading.time_ns for reading in got] == [n * 50_000_000 for n in range(1, 21)]
    assert got[4].range == sensor.measure(5).range
