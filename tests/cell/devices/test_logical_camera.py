from __future__ import annotations

import math

import numpy as np
import pytest

from cellwright.cell.devices.logical_camera import KNOWN_TYPES, CameraReading, Detection, LogicalCamera, TfFrame
from cellwright.engine.simulation import Simulation
from cellwright.util.pose import Pose, Vector3
from tests.cell.devices.scene import add_agv, add_part, empty_spec, make_simulation, move, scene_of

DOWN = (0.0, math.pi / 2, 0.0)
ABOVE = Pose.from_rpy((1.0, 2.0, 1.5), DOWN)
ROD, GEAR, DISK = "bin7|piston_rod_part_1", "populate_conveyor|gear_part_clone_0", "bin6|disk_part_2"
PARTS = ((ROD, "piston_rod_part"), (GEAR, "gear_part"), (DISK, "disk_part"))
SMALL = (0.01, 0.01, 0.01)
FAR_AWAY = Pose((30.0, 30.0, 0.0))


def camera_over(
    rod: Pose, gear: Pose = FAR_AWAY, disk: Pose = FAR_AWAY, *, name: str = "camera", noise: float = 1.0
) -> tuple[Simulation, LogicalCamera]:
    spec = empty_spec()
    for part, pose in zip((ROD, GEAR, DISK), (rod, gear, disk), strict=True):
        add_part(spec, part, pose, SMALL)
    simulation = make_simulation(spec)
    camera = LogicalCamera(name, ABOVE, scene_of(simulation, *PARTS), noise=noise)
    simulation.add(camera)
    return simulation, camera


def seen(reading: CameraReading) -> list[str]:
    return [detection.name for detection in reading.detections]


def test_pose_without_noise_is_exact_in_camera_frame() -> None:
    pose = Pose.from_rpy((1.1, 1.9, 1.0), (0.1, 0.2, 0.3))
    _, camera = camera_over(pose, noise=0.0)
    reading = camera.read()
    assert seen(reading) == [ROD]
    found = reading.detections[0]
    assert found.type == "piston_rod_part"
    # the camera looks down: its x is the world's -z, its z the world's x
    assert found.camera_T_model.position == pytest.approx((0.5, -0.1, 0.1), abs=1e-12)
    back = reading.world_T_camera @ found.camera_T_model
    assert back.position == pytest.approx(pose.position, abs=1e-12)
    assert back.rpy == pytest.approx(pose.rpy, abs=1e-12)


@pytest.mark.parametrize(
    ("position", "in_view"),
    [
        ((1.0, 2.0, 1.0), True),
        ((1.0, 2.0, 1.309), True),  # its lower face below the near plane at z 1.3
        ((1.0, 2.0, 1.311), False),
        ((1.0, 2.0, 0.741), True),  # its upper face above the far plane at z 0.75
        ((1.0, 2.0, 0.739), False),
        ((1.0, 2.30, 1.0), True),  # 0.5 tan 0.55 = 0.307 to either side
        ((1.0, 2.35, 1.0), False),
        ((1.20, 2.0, 1.0), True),  # 0.204 up and down in its view
        ((1.25, 2.0, 1.0), False),
        ((1.0, 2.0, 2.0), False),  # behind it
    ],
)
def test_part_is_detected_only_in_view(position: Vector3, in_view: bool) -> None:
    _, camera = camera_over(Pose(position))
    assert seen(camera.read()) == ([ROD] if in_view else [])


def test_occluded_parts_are_detected() -> None:
    _, camera = camera_over(Pose((1.0, 2.0, 1.2)), Pose((1.0, 2.0, 1.1)), Pose((1.0, 2.0, 1.0)))
    assert seen(camera.read()) == [ROD, GEAR, DISK]


def test_unknown_type_is_not_reported() -> None:
    spec = empty_spec()
    add_part(spec, "box_1", Pose((1.0, 2.0, 1.0)), SMALL)
    add_part(spec, "part3_1", Pose((1.1, 2.0, 1.0)), SMALL)
    simulation = make_simulation(spec)
    camera = LogicalCamera("camera", ABOVE, scene_of(simulation, ("box_1", "box"), ("part3_1", "part3")))
    simulation.add(camera)
    assert seen(camera.read()) == ["part3_1"]
    assert len(KNOWN_TYPES) == 14


def test_frame_names_contain_name_of_camera() -> None:
    _, camera = camera_over(Pose((1.0, 2.0, 1.2)), Pose((1.1, 2.0, 1.1)), name="logical_camera_2")
    reading = camera.read()
    assert reading.frames[0] == TfFrame("world", "logical_camera_2_frame", ABOVE)
    assert [(frame.parent, frame.child) for frame in reading.frames[1:]] == [
        ("logical_camera_2_frame", "logical_camera_2_piston_rod_part_1_frame"),
        ("logical_camera_2_frame", "logical_camera_2_gear_part_clone_0_frame"),
    ]
    # message and frame agree, including the noise
    assert [frame.pose for frame in reading.frames[1:]] == [each.camera_T_model for each in reading.detections]


def errors_of(detections: list[Detection], true: Pose) -> np.ndarray:
    """Return position errors [m] and the rotation vectors [rad] of the orientation errors, shape (n, 6)."""
    rows = []
    for detection in detections:
        measured = detection.camera_T_model
        turn = true.inverse() @ Pose((0.0, 0.0, 0.0), measured.quaternion)
        rows.append([*np.subtract(measured.position, true.position), *(2 * np.array(turn.quaternion[1:]))])
    return np.array(rows)


def test_noise_of_parts_is_unbiased_with_original_spread() -> None:
    pose = Pose.from_rpy((1.1, 1.9, 1.0), (0.4, -0.3, 2.0))
    _, camera = camera_over(pose)
    true = ABOVE.inverse() @ pose
    errors = errors_of([camera.measure(index).detections[0] for index in range(1, 2001)], true)
    assert np.abs(errors[:, :3].mean(axis=0)).max() < 4 * 0.001 / math.sqrt(2000)
    assert np.abs(errors[:, 3:].mean(axis=0)).max() < 4 * 0.01 / math.sqrt(2000)
    assert errors[:, :3].std(axis=0) == pytest.approx([0.001] * 3, rel=0.08)
    assert errors[:, 3:].std(axis=0) == pytest.approx([0.01] * 3, rel=0.08)
    mixing = np.corrcoef(errors.T) - np.eye(6)
    assert np.abs(mixing).max() < 0.1


def test_rotation_noise_is_applied_in_frame_of_part() -> None:
    pose = Pose.from_rpy((1.0, 2.0, 1.0), (0.0, 0.0, 1.0))
    _, camera = camera_over(pose)
    noise = camera.normal(4, 18)[:6]
    expected = (ABOVE.inverse() @ pose) @ Pose.from_rpy((0, 0, 0), tuple(0.01 * noise[3:]))
    assert camera.measure(4).detections[0].camera_T_model.quaternion == pytest.approx(expected.quaternion, abs=1e-12)


def test_noise_of_model_is_independent_of_other_models() -> None:
    gear = Pose((1.1, 2.0, 1.1))
    _, with_rod = camera_over(Pose((1.0, 2.0, 1.2)), gear)
    _, without = camera_over(Pose((9.0, 9.0, 0.0)), gear)
    assert with_rod.measure(5).detections[1] == without.measure(5).detections[0]
    one, other = with_rod.measure(5).detections
    assert one.camera_T_model.quaternion != other.camera_T_model.quaternion


def test_two_cameras_have_independent_noise() -> None:
    simulation, first = camera_over(Pose((1.0, 2.0, 1.0)), name="logical_camera_1")
    second = LogicalCamera("logical_camera_2", ABOVE, first.scene)
    simulation.add(second)
    a, b = first.read().detections[0], second.read().detections[0]
    assert (a.name, a.type) == (b.name, b.type)
    assert a.camera_T_model != b.camera_T_model
    assert a.frames[0].child == "logical_camera_1_piston_rod_part_1_frame"
    assert b.frames[0].child == "logical_camera_2_piston_rod_part_1_frame"


def over_the_agv(z: float, part_at: Vector3 = (9, 9, 9), number: int = 1) -> LogicalCamera:
    side = 1 if number == 1 else -1
    spec = empty_spec()
    add_agv(spec, number, (0.3, side * 3.3, 0.0), (0.0, 0.0, 0.0, 1.0) if number == 1 else (1.0, 0.0, 0.0, 0.0))
    add_part(spec, "gear_part_1", Pose(part_at), SMALL)
    simulation = make_simulation(spec)
    agv, tray = f"agv{number}", f"kit_tray_{number}"
    scene = scene_of(simulation, ("gear_part_1", "gear_part"), (agv, agv), (tray, "kit_tray"))
    camera = LogicalCamera("over_agv", Pose.from_rpy((0.3, side * 3.15, z), DOWN), scene)
    simulation.add(camera)
    return camera


@pytest.mark.parametrize("number", [1, 2])
def test_agv_is_exact_and_its_tray_has_noise(number: int) -> None:
    camera = over_the_agv(1.4, number=number)
    side = 1 if number == 1 else -1
    reading = camera.measure(3)
    assert [detection.type for detection in reading.detections] == [f"agv{number}", "kit_tray"]
    agv, tray = reading.detections
    world_T_agv = reading.world_T_camera @ agv.camera_T_model
    assert world_T_agv.position == pytest.approx((0.3, side * 3.3, 0.0), abs=1e-12)  # exact
    world_T_tray = reading.world_T_camera @ tray.camera_T_model
    assert world_T_tray.position == pytest.approx((0.3, side * 3.15, 0.75), abs=0.005)
    assert world_T_tray.position != pytest.approx((0.3, side * 3.15, 0.75), abs=1e-6)  # noisy

    assert tray.frames == ()
    own, of_the_tray = agv.frames
    assert (own.parent, own.child) == ("over_agv_frame", f"over_agv_agv{number}_frame")
    assert own.pose == agv.camera_T_model
    assert (of_the_tray.parent, of_the_tray.child) == (own.child, f"over_agv_kit_tray_{number}_frame")
    offset = of_the_tray.pose.position
    assert offset == pytest.approx((0.0, 0.15, 0.75), abs=0.005)
    assert offset != pytest.approx((0.0, 0.15, 0.75), abs=1e-6)


def test_noise_of_tray_frame_has_original_spread() -> None:
    camera = over_the_agv(1.4)
    offsets = np.array([camera.measure(n).detections[0].frames[1].pose.position for n in range(1, 1001)])
    assert offsets.mean(axis=0) == pytest.approx([0.0, 0.15, 0.75], abs=4 * 0.001 / math.sqrt(1000))
    assert offsets.std(axis=0) == pytest.approx([0.001] * 3, rel=0.1)


def test_tray_is_reported_only_with_its_agv() -> None:
    # from 1.6 m the view ends at z 0.85: above the plate, but below the top of the AGV's column
    assert [each.type for each in over_the_agv(1.6).read().detections] == ["agv1", "kit_tray"]
    # from 1.7 m it ends above the AGV, and the tray goes with it
    assert over_the_agv(1.7, part_at=(0.3, 3.15, 1.0)).read().detections[0].type == "gear_part"
    assert len(over_the_agv(1.7, part_at=(0.3, 3.15, 1.0)).read().detections) == 1


def test_ten_readings_per_second_follow_moved_part() -> None:
    simulation, camera = camera_over(Pose((1.0, 2.0, 1.0)))
    got: list[CameraReading] = []
    camera.listen(got.append)
    simulation.step_until(500_000_000)
    move(simulation, ROD, Pose((30.0, 30.0, 0.0)))
    simulation.step_until(10**9)
    assert [reading.time_ns for reading in got] == [n * 100_000_000 for n in range(1, 11)]
    assert [seen(reading) for reading in got] == [[ROD]] * 5 + [[]] * 5


def test_camera_over_empty_scene_detects_nothing() -> None:
    simulation = make_simulation(empty_spec())
    camera = LogicalCamera("camera", ABOVE, scene_of(simulation))
    simulation.add(camera)
    assert camera.read().detections == ()
    assert [frame.child for frame in camera.read().frames] == ["camera_frame"]
