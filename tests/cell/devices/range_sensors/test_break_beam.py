from __future__ import annotations

import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from cellwright.cell.devices.range_sensors import BeamReading, BreakBeam
from cellwright.engine.simulation import Simulation
from cellwright.util.pose import Pose
from tests.cell.devices.scene import CYLINDER, add_block, add_part, empty_spec, make_simulation, push

GEAR = "populate_conveyor|gear_part_clone_0"
GEAR_RADIUS = 0.0392
BELT_SPEED = 0.2
BEAM_POSE = Pose.from_rpy((1.6, 2.25, 0.91), (0.0, 0.0, math.pi))


def wall_at(distance: float, noise: float = 1.0) -> tuple[Simulation, BreakBeam]:
    beam = BreakBeam("break_beam", Pose(), noise=noise)
    spec = empty_spec()
    add_block(spec, (distance + 0.1, 0.0, 0.0), (0.1, 0.2, 0.2))
    return make_simulation(spec, beam), beam


@pytest.mark.parametrize("distance", [0.026, 0.3, 0.6321, 1.0249])
def test_range_is_measured_from_start_of_ray(distance: float) -> None:
    _, beam = wall_at(distance, noise=0.0)
    reading = beam.read()
    assert reading.detected
    assert reading.range == pytest.approx(distance - 0.025, abs=1e-9)


@pytest.mark.parametrize("distance", [1.0251, 1.5])
def test_object_beyond_end_of_ray_is_not_detected(distance: float) -> None:
    _, beam = wall_at(distance)
    reading = beam.read()
    assert not reading.detected
    assert reading.range == math.inf


def test_object_behind_or_beside_beam_is_not_detected() -> None:
    beam = BreakBeam("break_beam", Pose())
    spec = empty_spec()
    add_block(spec, (-0.1, 0.0, 0.0), (0.1, 0.1, 0.1))
    add_block(spec, (0.5, 0.11, 0.0), (0.1, 0.1, 0.1))
    make_simulation(spec, beam)
    assert not beam.read().detected


def test_range_noise_has_original_spread() -> None:
    _, beam = wall_at(0.525)
    ranges = np.array([beam.measure(index).range for index in range(1, 4001)])
    assert abs(ranges.mean() - 0.5) < 4 * 0.001 / math.sqrt(4000)
    assert ranges.std() == pytest.approx(0.001, rel=0.05)
    assert len(set(ranges.tolist())) == 4000


def test_noise_at_far_end_loses_objects_and_invents_none() -> None:
    _, beam = wall_at(1.0249)
    detected = [beam.measure(index).detected for index in range(1, 501)]
    assert 0.3 < np.mean(detected) < 0.7
    _, beam = wall_at(1.0251)
    assert not any(beam.measure(index).detected for index in range(1, 501))


def gear_on_the_belt(beam: BreakBeam, start_y: float = 2.6) -> Simulation:
    spec = empty_spec()
    add_block(spec, (1.21, 0.0, 0.8126), (0.327, 7.3, 0.09431))
    add_part(
        spec, GEAR, Pose((1.21, start_y, 0.9071)), (GEAR_RADIUS, 0.006, 0.0), shape=CYLINDER, centre=(0.0, 0.0, 0.0059)
    )
    simulation = make_simulation(spec, beam)
    push(simulation, GEAR, (0.0, -BELT_SPEED, 0.0))
    return simulation


def test_gear_interrupts_beam_for_its_width() -> None:
    beam = BreakBeam("break_beam", BEAM_POSE)
    simulation = gear_on_the_belt(beam)
    got: list[BeamReading] = []
    beam.listen(got.append)
    simulation.step_until(4 * 10**9)
    during = [reading.time_ns / 1e9 for reading in got if reading.detected]
    first, last = (2.6 - 2.25 - GEAR_RADIUS) / BELT_SPEED, (2.6 - 2.25 + GEAR_RADIUS) / BELT_SPEED
    assert last - first == pytest.approx(0.392)
    expected = [n * 0.05 for n in range(1, 81) if first < n * 0.05 < last]
    assert during == pytest.approx(expected)
    assert len(during) == 7  # 0.392 s at 20 Hz: 7 or 8, depending on the phase


def test_fast_beam_measures_width_of_gear() -> None:
    beam = BreakBeam("break_beam", BEAM_POSE, period=Fraction(1, 500), noise=0.0)
    simulation = gear_on_the_belt(beam)
    changes: list[BeamReading] = []
    beam.listen_changes(changes.append)
    simulation.step_until(4 * 10**9)
    begin, end = changes
    assert (end.time_ns - begin.time_ns) / 1e9 * BELT_SPEED == pytest.approx(2 * GEAR_RADIUS, abs=BELT_SPEED / 500)


def test_change_listener_gets_transitions_only() -> None:
    beam = BreakBeam("break_beam", BEAM_POSE)
    simulation = gear_on_the_belt(beam)
    every: list[BeamReading] = []
    changes: list[BeamReading] = []
    beam.listen(every.append)
    beam.listen_changes(changes.append)
    simulation.step_until(4 * 10**9)
    assert [reading.detected for reading in changes] == [True, False]
    turns = [after for before, after in pairwise(every) if before.detected != after.detected]
    assert changes == turns


def test_first_reading_is_change_only_if_beam_is_interrupted() -> None:
    interrupted = BreakBeam("break_beam", BEAM_POSE)
    simulation = gear_on_the_belt(interrupted, start_y=2.27)
    changes: list[BeamReading] = []
    interrupted.listen_changes(changes.append)
    simulation.step_until(100_000_000)
    assert [(reading.sample, reading.detected) for reading in changes] == [(1, True)]

    whole = BreakBeam("break_beam", BEAM_POSE)
    simulation = gear_on_the_belt(whole)
    whole.listen_changes(lambda reading: pytest.fail(f"no change: {reading}"))
    simulation.step_until(500_000_000)


def test_changes_are_independent_of_other_listeners() -> None:
    def changes_of_a_late_listener(*, with_others: bool) -> list[BeamReading]:
        beam = BreakBeam("break_beam", BEAM_POSE, latency=Fraction(2, 100))
        simulation = gear_on_the_belt(beam)
        if with_others:
            beam.listen(lambda _: None)
            beam.listen_changes(lambda _: None)
        simulation.step_until(1_700_000_000)  # the gear stands in the beam
        changes: list[BeamReading] = []
        beam.listen_changes(changes.append)
        simulation.step_until(4 * 10**9)
        return changes

    alone = changes_of_a_late_listener(with_others=False)
    assert [reading.detected for reading in alone] == [False]  # the earlier interruption is no change any more
    assert alone == changes_of_a_late_listener(with_others=True)


def test_reset_beam_is_uninterrupted() -> None:
    beam = BreakBeam("break_beam", BEAM_POSE)
    simulation = gear_on_the_belt(beam)
    changes: list[BeamReading] = []
    leave = beam.listen_changes(changes.append)
    simulation.step_until(1_700_000_000)
    assert [reading.detected for reading in changes] == [True]
    simulation.reset()
    simulation.step_until(500_000_000)
    assert len(changes) == 1
    leave()
    push(simulation, GEAR, (0.0, -BELT_SPEED, 0.0))
    simulation.step_until(4 * 10**9)
    assert len(changes) == 1
