from __future__ import annotations

import pytest

from cellwright.cell.devices.logical_camera import QualityControlSensor
from cellwright.util.pose import Pose, Vector3
from tests.cell.devices.scene import add_agv, add_part, empty_spec, make_simulation, scene_of
from tests.support.places import AGVS

SMALL = (0.01, 0.01, 0.005)
ON_TRAY: dict[int, Vector3] = {1: (0.3, 3.15, 0.76), 2: (0.3, -3.15, 0.76)}


def sensor_with(number: int, faulty: set[str], place: Vector3, noise: float = 0.0) -> QualityControlSensor:
    """Return a sensor with two parts at a place, and an AGV and tray under them."""
    spec = empty_spec()
    add_agv(spec, number, (0.3, 3.3 if number == 1 else -3.3, 0.0), (0, 0, 0, 1) if number == 1 else (1, 0, 0, 0))
    add_part(spec, "bin7|piston_rod_part_3", Pose(place), SMALL)
    add_part(spec, "bin7|piston_rod_part_4", Pose((place[0] + 0.05, place[1], place[2])), SMALL)
    simulation = make_simulation(spec)
    tray = f"kit_tray_{number}"
    scene = scene_of(
        simulation,
        ("bin7|piston_rod_part_3", "piston_rod_part"),
        ("bin7|piston_rod_part_4", "piston_rod_part"),
        (f"agv{number}", f"agv{number}"),
        (tray, "kit_tray"),
    )
    sensor = QualityControlSensor(AGVS[number], scene, faulty, noise=noise)
    simulation.add(sensor)
    return sensor


@pytest.mark.parametrize("number", [1, 2])
def test_only_faulty_parts_are_reported(number: int) -> None:
    sensor = sensor_with(number, {"piston_rod_part_4"}, ON_TRAY[number])
    assert sensor.name == f"quality_control_sensor_{number}"
    reading = sensor.read()
    assert [detection.name for detection in reading.detections] == ["bin7|piston_rod_part_4"]
    x, y, z = (reading.world_T_camera @ reading.detections[0].camera_T_model).position
    assert (x - 0.05, y, z) == pytest.approx(ON_TRAY[number], abs=1e-12)
    assert reading.frames[1].child == f"quality_control_sensor_{number}_piston_rod_part_4_frame"


@pytest.mark.parametrize("faulty", [set(), {"gear_part_1"}, {"bin7|piston_rod_part_3"}, {"agv1", "kit_tray_1"}])
def test_good_parts_are_not_reported(faulty: set[str]) -> None:
    assert sensor_with(1, faulty, ON_TRAY[1]).read().detections == ()


@pytest.mark.parametrize(
    ("place", "seen"),
    [
        ((0.3, 3.15, 0.755), True),
        ((0.3, 3.15, 0.79), False),  # held above the plate: nearer than 0.73 m
        ((0.3, 3.15, 0.70), False),
        ((0.07, 2.82, 0.76), True),  # the far corner of the tray
        ((0.3, 2.6, 0.76), False),  # beyond the view, which is 1.56 m long along y
        ((0.3, 4.4, 0.76), False),
        ((-0.05, 3.15, 0.76), False),  # and 0.55 m wide along x
    ],
)
def test_view_is_thin_slice_over_tray(place: Vector3, seen: bool) -> None:
    reading = sensor_with(1, {"piston_rod_part_3"}, place).read()
    assert bool(reading.detections) == seen


def test_parts_are_reported_with_noise_of_logical_camera() -> None:
    sensor = sensor_with(1, {"piston_rod_part_3"}, ON_TRAY[1], noise=1.0)
    true = sensor.world_T_sensor.inverse() @ Pose(ON_TRAY[1])
    errors = [sensor.measure(n).detections[0].camera_T_model.position[0] - true.position[0] for n in range(1, 200)]
    assert 0.0008 < (sum(e * e for e in errors) / len(errors)) ** 0.5 < 0.0012
