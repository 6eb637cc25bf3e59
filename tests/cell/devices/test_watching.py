"""Subscribers change nothing: a run with a subscriber to every sensor equals the run without."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction

import pytest

from cellwright.cell.devices.logical_camera import LogicalCamera, QualityControlSensor
from cellwright.cell.devices.range_sensors import BreakBeam, LaserProfiler, ProximitySensor
from cellwright.engine.simulation import Simulation
from cellwright.util.pose import Pose
from tests.cell.devices.scene import add_agv, add_block, add_part, empty_spec, make_simulation, push, scene_of
from tests.support.places import AGVS

NAMES = [f"bin7|piston_rod_part_{n}" for n in range(12)]


def tumbling_parts(timestep: Fraction, *, watched: bool) -> tuple[Simulation, list[object]]:
    spec = empty_spec()
    spec.option.gravity = [0.0, 0.0, -9.81]
    spec.option.enableflags = 1 << 5  # sleep
    add_block(spec, (0.0, 0.0, 0.7), (2.0, 4.0, 0.025))
    add_agv(spec, 1, (0.3, 3.3, 0.0))
    for n, name in enumerate(NAMES):
        add_part(spec, name, Pose.from_rpy((0.1 * n - 0.5, 0.05 * n, 0.85 + 0.03 * n), (0.1 * n, 0.2, 0.0)))
    simulation = make_simulation(spec, timestep=timestep)
    scene = scene_of(simulation, *((name, "piston_rod_part") for name in NAMES), ("agv1", "agv1"))
    down = Pose.from_rpy((0.0, 0.2, 1.4), (0.0, math.pi / 2, 0.0))
    beam = BreakBeam("break_beam", Pose((-0.6, 0.2, 0.8)))
    proximity = ProximitySensor("proximity_sensor", Pose((-0.3, 0.2, 0.8)), latency=Fraction(1, 100))
    profiler = LaserProfiler("laser_profiler", down)
    camera = LogicalCamera("logical_camera", down, scene, latency=Fraction(1, 30))
    quality = QualityControlSensor(AGVS[1], scene, ["piston_rod_part_1"])
    for sensor in (beam, proximity, profiler, camera, quality):
        simulation.add(sensor)
    push(simulation, NAMES[0], (0.3, 0.1, 0.0))
    got: list[object] = []
    if watched:
        beam.listen(got.append)
        beam.listen_changes(got.append)
        proximity.listen(got.append)
        profiler.listen(got.append)
        camera.listen(got.append)
        quality.listen(got.append)
    return simulation, got


@pytest.mark.parametrize("timestep", [Fraction(1, 500), Fraction(1, 240)], ids=str)
def test_listeners_change_no_state_hash(timestep: Fraction) -> None:
    alone, _ = tumbling_parts(timestep, watched=False)
    watched, got = tumbling_parts(timestep, watched=True)
    for until in (200_000_000, 600_000_000, 1_200_000_000):
        alone.step_until(until)
        watched.step_until(until)
        assert watched.state_hash() == alone.state_hash()
    assert len(got) > 100


def test_subscribing_and_leaving_changes_no_state_hash() -> None:
    alone, _ = tumbling_parts(Fraction(1, 500), watched=False)
    watched, _ = tumbling_parts(Fraction(1, 500), watched=False)
    camera = watched.device("logical_camera")
    assert isinstance(camera, LogicalCamera)
    leave: Callable[[], None] | None = None
    for step in range(1, 501):
        if step % 7 == 0:
            if leave is None:
                leave = camera.listen(lambda _: None)
            else:
                leave()
                leave = None
        if step % 11 == 0:
            camera.read()
        alone.step()
        watched.step()
    assert watched.state_hash() == alone.state_hash()
