"""Sensors of the lesson's cell measure what stands and moves there."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.devices.logical_camera import CameraReading, LogicalCamera, QualityControlSensor
from cellwright.cell.devices.range_sensors import SOLID_GROUPS, BeamReading, BreakBeam, LaserProfiler, ProximitySensor
from cellwright.cell.model.build import WorldPart
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.util.pose import Pose

BELT_TOP = 0.90691
GEAR = "populate_conveyor|gear_part_clone_0"
GEAR_RADIUS = 0.0392


@pytest.fixture(scope="module")
def lesson() -> Cell:
    loaded = load_trial([find_trial("lesson")])
    assert loaded.trial is not None
    return Cell(replace(loaded.trial, faulty_parts=frozenset({"piston_rod_part_2"})))


@pytest.fixture
def cell(lesson: Cell) -> Iterator[Cell]:
    """Return the cell at the beginning of a run."""
    lesson.reset()
    yield lesson
    for sensor in (*lesson.sensors.values(), *lesson.quality.values()):
        sensor.close()


def camera(cell: Cell, name: str) -> LogicalCamera:
    sensor = cell.sensors[name]
    assert isinstance(sensor, LogicalCamera)
    return sensor


def names(reading: CameraReading) -> list[str]:
    return [detection.name for detection in reading.detections]


def test_solid_shapes_of_cell_are_visible_to_rays(cell: Cell) -> None:
    """The engine lets rays pass fully transparent geoms, whatever their group."""
    model = cell.world.model
    touching = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    in_play = np.isin(model.geom_group, SOLID_GROUPS)
    assert (model.geom_rgba[touching & in_play, 3] > 0).all()
    assert not touching[model.geom_group == 2].any()


@pytest.mark.parametrize("start", [2.5, 2.491])
def test_break_beam_detects_gear_on_belt_for_its_width(cell: Cell, start: float) -> None:
    beam = cell.sensors["break_beam"]
    assert isinstance(beam, BreakBeam)
    cell.parts.appear(GEAR, Pose((1.21, start, BELT_TOP + 0.0002)))
    cell.conveyors["belt"].set_power(100.0)
    every: list[BeamReading] = []
    changes: list[BeamReading] = []
    beam.listen(every.append)
    beam.listen_changes(changes.append)
    cell.simulation.step_until(2 * 10**9)
    assert [reading.detected for reading in changes] == [True, False]
    count = sum(reading.detected for reading in every)
    assert count * 0.05 == pytest.approx(2 * GEAR_RADIUS / 0.2, abs=0.05)
    # it meets the beam when its rim is at y 2.25, within a sample and the start of the belt
    met = (start - 2.25 - GEAR_RADIUS) / 0.2
    assert changes[0].time_ns / 1e9 == pytest.approx(met + 0.025, abs=0.05)
    nearest = min(reading.range for reading in every)
    assert nearest == pytest.approx(1.575 - (1.21 + GEAR_RADIUS), abs=0.004)


def test_break_beam_over_empty_belt_detects_nothing(cell: Cell) -> None:
    beam = cell.sensors["break_beam"]
    assert isinstance(beam, BreakBeam)
    assert not any(beam.measure(index).detected for index in range(20))


def test_proximity_sensor_detects_belt_and_gear_in_range(cell: Cell) -> None:
    """It stands 9 mm above the belt, so that its lowest rays meet the belt just within their reach."""
    sensor = cell.sensors["proximity_sensor"]
    assert isinstance(sensor, ProximitySensor)
    readings = [sensor.measure(index).range for index in range(400)]
    assert np.mean(readings) == pytest.approx((0.916 - BELT_TOP) / math.sin(0.0625), abs=3e-4)
    cell.parts.appear(GEAR, Pose((0.973 + 0.08 + GEAR_RADIUS, 2.6, BELT_TOP + 0.0002)))
    cell.simulation.refresh()
    readings = [sensor.measure(index).range for index in range(400)]
    assert np.mean(readings) == pytest.approx(0.08, abs=3e-4)


def test_laser_profiler_detects_gear_but_not_belt(cell: Cell) -> None:
    sensor = cell.sensors["laser_profiler"]
    assert isinstance(sensor, LaserProfiler)
    assert np.isinf(sensor.read().ranges).all()
    cell.parts.appear(GEAR, Pose((1.21, 3.94, BELT_TOP + 0.0002)))
    ranges = sensor.read().ranges
    hits = np.isfinite(ranges)
    assert ranges[hits].mean() == pytest.approx(1.64 - BELT_TOP - 0.0121, abs=1e-3)
    assert hits.sum() == pytest.approx(2 * GEAR_RADIUS / (0.721 * 0.502 / 399), abs=3)


def test_camera_over_agv_detects_agv_and_tray(cell: Cell) -> None:
    sensor = camera(cell, "logical_camera_over_agv1")
    reading = sensor.read()
    assert names(reading) == ["agv1", "kit_tray_1"]
    agv, tray = (reading.world_T_camera @ each.camera_T_model for each in reading.detections)
    assert agv.position == pytest.approx((0.3, 3.3, 0.0), abs=1e-3)
    assert tray.position == pytest.approx((0.3, 3.15, 0.75), abs=6e-3)
    assert [frame.child for frame in reading.frames] == [
        "logical_camera_over_agv1_frame",
        "logical_camera_over_agv1_agv1_frame",
        "logical_camera_over_agv1_kit_tray_1_frame",
    ]


def corners(cell: Cell, part: WorldPart) -> np.ndarray:
    """Return corners of the box around a part along the world's axes, from the corners of its shapes' own boxes."""
    data, model = cell.simulation.data, cell.world.model
    points = np.concatenate(
        [
            data.geom_xpos[geom]
            + np.array(list(itertools.product((-1, 1), repeat=3)))
            * model.geom_aabb[geom, 3:]
            @ data.geom_xmat[geom].reshape(3, 3).T
            for geom in part.geoms
        ]
    )
    return np.array(list(itertools.product(*zip(points.min(axis=0), points.max(axis=0), strict=True))))


def in_view(sensor: LogicalCamera, box: np.ndarray) -> bool:
    """Return whether a box is in view, plane by plane: some corner must be on the inner side of each."""
    x, y, z = np.array([sensor.world_T_sensor.inverse().transform(tuple(corner)) for corner in box.tolist()]).T
    wide = math.tan(0.55) * x
    high = wide / 1.5
    sides = (x - 0.2, 0.75 - x, wide - y, wide + y, high - z, high + z)
    return all(side.max() >= 0 for side in sides)


def test_camera_over_bins_detects_exactly_parts_in_view(cell: Cell) -> None:
    sensor = camera(cell, "logical_camera")
    reading = sensor.read()
    rods = [part for part in cell.world.parts if part.type == "piston_rod_part"]
    everything = [part for part in cell.world.parts if part.type == "piston_rod_part" or not part.pooled]
    # gears are round, and the boxes of `corners` fit only angular parts: all of them stand in bin 8, far outside
    seen = [part.name for part in everything if in_view(sensor, corners(cell, part))]
    assert names(reading) == seen
    assert len(seen) == len(rods) == 12
    for detection in reading.detections:
        true = cell.parts.pose(cell.parts.part(detection.name))
        measured = reading.world_T_camera @ detection.camera_T_model
        assert measured.position == pytest.approx(true.position, abs=6e-3)


def test_camera_over_part_of_bin_detects_only_parts_in_view(cell: Cell) -> None:
    pose = Pose.from_rpy((-0.45, 0.1, 1.1), (0.0, math.pi / 2, 0.3))
    sensor = LogicalCamera("extra", pose, camera(cell, "logical_camera").scene)
    sensor.attach(cell.simulation)
    rods = [part for part in cell.world.parts if part.type == "piston_rod_part"]
    seen = {part.name for part in rods if in_view(sensor, corners(cell, part))}
    assert set(names(sensor.read())) == seen
    assert 0 < len(seen) < len(rods)


def test_camera_detects_part_only_where_it_was_placed(cell: Cell) -> None:
    rod = cell.parts.part("bin7|piston_rod_part_5")
    over_bins, over_agv = camera(cell, "logical_camera"), camera(cell, "logical_camera_over_agv1")
    assert rod.name in names(over_bins.read())
    cell.parts.place(rod, Pose((0.3, 3.15, 0.756)))
    assert rod.name not in names(over_bins.read())
    assert names(over_agv.read()) == [rod.name, "agv1", "kit_tray_1"]
    cell.parts.put_away(rod)
    assert rod.name not in names(over_bins.read()) + names(over_agv.read())


def test_quality_control_detects_only_faulty_parts_on_its_tray(cell: Cell) -> None:
    sensor: QualityControlSensor = cell.quality[1]
    assert names(sensor.read()) == []
    for number, x in ((2, 0.2), (3, 0.35)):
        cell.parts.place(cell.parts.part(f"bin7|piston_rod_part_{number}"), Pose((x, 3.1, 0.756)))
    assert names(sensor.read()) == ["bin7|piston_rod_part_2"]
    assert names(cell.quality[2].read()) == []


def test_camera_tracks_agv_until_it_leaves_view(cell: Cell) -> None:
    sensor = camera(cell, "logical_camera_over_agv1")
    got: list[CameraReading] = []
    sensor.listen(got.append)
    cell.agvs[1].send("order_0_kit_0")
    cell.simulation.step_until(3 * 10**9)
    assert names(got[0]) == ["agv1", "kit_tray_1"]
    assert names(got[-1]) == []
    positions = [
        (each.world_T_camera @ each.detections[0].camera_T_model).position[0] for each in got if each.detections
    ]
    assert positions == sorted(positions, reverse=True)  # exact, so without the jumps of noise
    assert positions[-1] < -0.5
