from __future__ import annotations

import math

import numpy as np
import pytest

from cellwright.cell.devices.range_sensors import FAN_ANGLE_STEP, FAN_RAY_COUNT, LaserProfiler, ProfileReading
from cellwright.util.pose import Pose
from tests.cell.devices.scene import CYLINDER, add_block, add_part, empty_spec, make_simulation

ANGLES = np.linspace(-0.251, 0.251, 400)
LESSON_POSE = Pose.from_rpy((1.21, 4.0, 1.64), (-math.pi, math.pi / 2, math.pi / 2))


def facing(distance: float, noise: float = 1.0) -> LaserProfiler:
    """Return a profiler with a large wall before it, at the height of its fan."""
    profiler = LaserProfiler("laser_profiler", Pose(), noise=noise)
    spec = empty_spec()
    add_block(spec, (distance + 0.1, 0.0, 0.06), (0.1, 2.0, 0.01))
    make_simulation(spec, profiler)
    return profiler


def test_ranges_to_wall_are_exact() -> None:
    ranges = facing(0.5, noise=0.0).read().ranges
    assert ranges.shape == (FAN_RAY_COUNT,)
    assert ranges == pytest.approx(0.5 / np.cos(ANGLES), abs=1e-9)


def test_last_angle_is_that_of_message() -> None:
    last = -0.251 + FAN_ANGLE_STEP * (FAN_RAY_COUNT - 1)
    assert last == pytest.approx(0.251, abs=1e-12)


def test_ranges_run_from_right_to_left() -> None:
    profiler = LaserProfiler("laser_profiler", Pose(), noise=0.0)
    spec = empty_spec()
    add_block(spec, (0.6, 0.2, 0.06), (0.1, 0.2, 0.01))  # all of it at y >= 0
    make_simulation(spec, profiler)
    ranges = profiler.read().ranges
    assert np.isinf(ranges[:200]).all()
    assert np.isfinite(ranges[200:]).all()


def test_far_object_is_infinite_and_near_object_is_ignored() -> None:
    ranges = facing(0.72, noise=0.0).read().ranges
    reached = 0.72 / np.cos(ANGLES) <= 0.725
    assert (np.isfinite(ranges) == reached).all()
    assert 0 < reached.sum() < FAN_RAY_COUNT

    profiler = LaserProfiler("laser_profiler", Pose(), noise=0.0)
    spec = empty_spec()
    add_block(spec, (0.1, 0.0, 0.06), (0.05, 0.5, 0.01))
    add_block(spec, (0.6, 0.0, 0.06), (0.1, 0.5, 0.01))
    make_simulation(spec, profiler)
    assert profiler.read().ranges == pytest.approx(0.5 / np.cos(ANGLES), abs=1e-9)


def test_noise_is_independent_per_ray_and_sample() -> None:
    profiler = facing(0.5)
    residual = np.array([profiler.measure(n).ranges for n in range(1, 101)]) - 0.5 / np.cos(ANGLES)
    assert abs(residual.mean()) < 4 * 0.001 / math.sqrt(residual.size)
    assert residual.std() == pytest.approx(0.001, rel=0.02)
    assert residual.std(axis=0) == pytest.approx(0.001, rel=0.4)
    assert residual.std(axis=1) == pytest.approx(0.001, rel=0.2)
    neighbours = np.corrcoef(residual[:, :-1].ravel(), residual[:, 1:].ravel())[0, 1]
    assert abs(neighbours) < 0.03


def test_noise_of_ray_is_independent_of_other_rays() -> None:
    whole = facing(0.5).measure(3).ranges
    half = LaserProfiler("laser_profiler", Pose())
    spec = empty_spec()
    add_block(spec, (0.6, 1.0, 0.06), (0.1, 1.0, 0.01))
    make_simulation(spec, half)
    assert (half.measure(3).ranges[200:] == whole[200:]).all()


def test_noise_stays_within_range() -> None:
    far = np.array([facing(0.7245).measure(n).ranges for n in range(1, 30)])
    assert far[np.isfinite(far)].max() == 0.725
    near = np.array([facing(0.1812).measure(n).ranges for n in range(1, 30)])
    assert near.min() == 0.181


def test_ranges_of_reading_are_read_only() -> None:
    for distance in (0.5, 5.0):
        with pytest.raises(ValueError, match="read-only"):
            facing(distance).read().ranges[0] = 0.0


def test_profiler_of_lesson_detects_part_but_not_belt() -> None:
    """It looks down from 0.733 m above the belt: just out of reach, while the top of a gear is not."""
    profiler = LaserProfiler("laser_profiler", LESSON_POSE, noise=0.0)
    spec = empty_spec()
    add_block(spec, (1.21, 0.0, 0.8126), (0.327, 7.3, 0.09431))
    add_part(spec, "gear_part_1", Pose((1.21, 3.94, 0.9069)), (0.0392, 0.006, 0), CYLINDER, centre=(0, 0, 0.0059))
    make_simulation(spec, profiler)
    ranges = profiler.read().ranges
    top = 1.64 - (0.9069 + 0.0119)
    across = np.abs(top * np.tan(ANGLES)) < 0.0392 - 1e-6
    assert ranges[across] == pytest.approx(top / np.cos(ANGLES[across]), abs=1e-9)
    assert np.isfinite(ranges).sum() == across.sum()
    assert 0.0784 / (top * FAN_ANGLE_STEP) == pytest.approx(across.sum(), abs=2)


def test_profiler_reads_hundred_times_per_second() -> None:
    profiler = facing(0.5)
    got: list[ProfileReading] = []
    profiler.listen(got.append)
    profiler.simulation.step_until(250_000_000)
    assert [reading.time_ns for reading in got] == [n * 10_000_000 for n in range(1, 26)]
    assert (got[6].ranges == profiler.measure(7).ranges).all()
