"""Contents of a real cell's messages, compared with independent figures."""

from __future__ import annotations

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.effects import KitSubmitted
from cellwright.config.trial.trial import Kit, KitObject, Order, Trial
from cellwright.engine.snapshot import restore_snapshot, take_snapshot
from cellwright.middleware.messages.conversions import pose_from_message
from cellwright.util.pose import Pose
from tests.support.cells import GEARS, INITIAL, JOINTS, KITTING, WHOLE, Ear, on_tray, order, run, stamp_of, start, way

GEAR = "populate_conveyor|gear_part_clone_0"
ALPHABETICAL = (
    "elbow_joint",
    "linear_arm_actuator_joint",
    "shoulder_lift_joint",
    "shoulder_pan_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
    "vacuum_gripper_joint",
)


def at_rest(trial: Trial = WHOLE) -> Cell:
    return Cell(trial, competition=False)


def test_joint_states_have_eight_joints_and_still_gripper_joint() -> None:
    cell = at_rest(replace(WHOLE, initial_joint_states={}))
    ear = Ear(cell, "joint_states")
    run(cell, 0.1)
    cell.bus.publish("/ariac/arm/command", way(tuple(value + 0.1 for value in INITIAL)))
    run(cell, 0.5)
    expected = {**dict(zip(JOINTS, INITIAL, strict=True)), "vacuum_gripper_joint": 0.0}
    for message in ear.messages:
        assert tuple(message.name) == ALPHABETICAL
        assert {len(message.position), len(message.velocity), len(message.effort)} == {8}
        assert (message.position[7], message.velocity[7], message.effort[7]) == (0.0, 0.0, 0.0)
    assert [stamp_of(message) for message in ear.messages] == [n * 20_000_000 for n in range(1, 31)]
    assert ear.messages[0].position == pytest.approx([expected[name] for name in ALPHABETICAL], abs=0.01)
    joints = cell.arm.read() if cell.arm is not None else None
    assert joints is not None
    last = ear.messages[-1]
    for index, name in enumerate(ALPHABETICAL[:-1]):
        here = JOINTS.index(name)
        assert (last.position[index], last.velocity[index], last.effort[index]) == (
            joints.positions[here],
            joints.velocities[here],
            joints.efforts[here],
        )


def test_arm_state_has_desired_actual_and_error() -> None:
    cell = at_rest(replace(WHOLE, initial_joint_states={}))
    ear = Ear(cell, "arm/state")
    cell.bus.publish("/ariac/arm/command", way(tuple(value + 0.1 for value in INITIAL)))
    run(cell, 0.4)
    message = ear.messages[-1]
    assert tuple(message.joint_names) == JOINTS
    assert stamp_of(message) == 400_000_000
    np.testing.assert_allclose(message.desired.positions, np.add(INITIAL, 0.04), atol=1e-9)
    np.testing.assert_allclose(message.desired.velocities, [0.1] * 7, atol=1e-9)
    np.testing.assert_allclose(message.error.positions, message.desired.positions - message.actual.positions)
    np.testing.assert_allclose(message.error.velocities, message.desired.velocities - message.actual.velocities)
    assert np.abs(message.error.positions).max() < 0.1


def test_gripper_state_has_enabled_and_attached_separately() -> None:
    cell = at_rest()
    assert cell.gripper is not None
    ear = Ear(cell, "gripper/state")
    run(cell, 0.05)
    cell.gripper.set_enabled(True)
    run(cell, 0.25)
    cell.gripper.set_enabled(False)
    run(cell, 0.002)
    seen = [(message.enabled, message.attached) for message in ear.messages]
    assert [pair for index, pair in enumerate(seen) if index == 0 or seen[index - 1] != pair] == [
        (False, False),
        (True, False),
        (True, True),
        (False, False),
    ]
    assert cell.gripper.lost_reason == "released"


def test_break_beam_message_has_detection_and_limits() -> None:
    trial = replace(WHOLE, bin_parts=(), extra_parts=())
    cell = at_rest(trial)
    ear, changes = Ear(cell, "break_beam_1"), Ear(cell, "break_beam_1_change")
    run(cell, 0.1)
    whole = ear.messages[-1]
    assert (whole.header.frame_id, stamp_of(whole)) == ("break_beam_1_frame", 100_000_000)
    assert whole.object_detected is False
    assert (whole.min_range, whole.max_range) == (np.float32(0.025), np.float32(1.025))
    assert len(changes) == 0
    cell.parts.appear(GEAR, Pose((1.1, 2.25, 0.907)))  # on the belt, which stands still
    run(cell, 0.2)
    cell.parts.put_away(cell.parts.part(GEAR))
    run(cell, 0.2)
    assert [message.object_detected for message in ear.messages] == [False] * 2 + [True] * 4 + [False] * 4
    assert [message.object_detected for message in changes.messages] == [True, False]
    assert [stamp_of(message) for message in changes.messages] == [150_000_000, 350_000_000]
    late = Ear(cell, "break_beam_1_change")
    assert [message.object_detected for message in late.messages] == [False]  # latched


def test_proximity_message_has_range_and_limits() -> None:
    cell = at_rest()
    ear = Ear(cell, "proximity_sensor_1")
    run(cell, 0.1)
    cell.parts.place(cell.parts.part("bin8|gear_part_1"), Pose((1.11, 2.6, 0.907)))
    run(cell, 0.1)
    empty, near = ear.messages[1], ear.messages[-1]
    assert (near.header.frame_id, stamp_of(near)) == ("proximity_sensor_1_frame", 200_000_000)
    assert near.radiation_type == 0
    assert near.field_of_view == np.float32(0.125)
    assert (near.min_range, near.max_range) == (np.float32(0.01), np.float32(0.15))
    assert empty.range == np.float32(0.15)
    # 1.11 - 0.0392 (the gear's radius) - 0.95 - 0.023 (where the rays begin) is 0.0978 m
    assert near.range == pytest.approx(0.0978, abs=0.004)


def test_laser_scan_message_has_400_ranges_and_limits() -> None:
    cell = at_rest()
    ear = Ear(cell, "laser_profiler_1")
    run(cell, 0.01)
    cell.parts.place(cell.parts.part("bin8|gear_part_1"), Pose((1.21, 3.94, 0.907)))
    run(cell, 0.02)
    scan = ear.messages[-1]
    assert (scan.header.frame_id, stamp_of(scan)) == ("laser_profiler_1_frame", 30_000_000)
    assert (scan.angle_min, scan.angle_max) == (np.float32(-0.251), np.float32(0.251))
    assert scan.angle_increment == pytest.approx(0.502 / 399, rel=1e-6)
    assert (scan.range_min, scan.range_max) == (np.float32(0.181), np.float32(0.725))
    assert (scan.time_increment, scan.scan_time) == (0.0, 0.0)
    assert scan.ranges.dtype == np.float32
    assert scan.ranges.shape == scan.intensities.shape == (400,)
    assert not scan.intensities.any()
    # the rays begin 0.06 m along the sensor's z axis, which is the world's -y; the belt, 0.733 m below, is out of their
    # reach, the gear on it, 0.721 m below and 78 mm wide, is not
    bare, with_gear = ear.messages[0].ranges, scan.ranges
    assert np.isinf(bare).all()
    hits = np.isfinite(with_gear)
    assert hits.sum() == pytest.approx(0.0784 / 0.721 / scan.angle_increment, abs=3)
    assert with_gear[hits] == pytest.approx(0.721, abs=0.005)


def test_logical_camera_message_has_types_and_poses_in_its_frame() -> None:
    cell = at_rest()
    ear = Ear(cell, "logical_camera_1")
    run(cell, 0.3)
    image = ear.messages[-1]
    world_T_camera = Pose.from_rpy((-0.3, 0.23, 1.4), (0.0, math.pi / 2, 0.0))
    q = image.pose.orientation
    assert (q.x, q.y, q.z, q.w) == pytest.approx((0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5)))
    assert [model.type for model in image.models] == ["piston_rod_part"]
    true = world_T_camera.inverse() @ cell.parts.pose(cell.parts.part("bin7|piston_rod_part_5"))
    seen = pose_from_message(image.models[0].pose)
    assert seen.position == pytest.approx(true.position, abs=0.005)
    assert abs(sum(a * b for a, b in zip(seen.quaternion, true.quaternion, strict=True))) > 0.999
    assert seen.position != true.position  # because of noise
    assert pose_from_message(image.pose).position == pytest.approx(world_T_camera.position)


def test_camera_over_agv_reports_agv_tray_and_parts() -> None:
    cell = at_rest()
    ear = Ear(cell, "logical_camera_2")
    run(cell, 0.1)
    assert sorted(model.type for model in ear.messages[0].models) == ["agv1", "gear_part", "gear_part", "kit_tray"]


def test_quality_control_reports_faulty_parts_only() -> None:
    trial = replace(WHOLE, extra_parts=(*on_tray(*GEARS), *on_tray(*GEARS, number=2, first=3)))
    cell = at_rest(trial)
    first, second = Ear(cell, "quality_control_sensor_1"), Ear(cell, "quality_control_sensor_2")
    run(cell, 0.2)
    assert [model.type for model in first.messages[-1].models] == ["gear_part"]
    assert second.messages[-1].models == []
    world_T_camera = pose_from_message(first.messages[-1].pose)
    assert world_T_camera.position == (0.3, 3.5, 1.5)
    seen = world_T_camera @ pose_from_message(first.messages[-1].models[0].pose)
    assert seen.position == pytest.approx(cell.parts.pose(cell.parts.part("tray1|gear_part_2")).position, abs=0.006)


def test_order_is_published_once_and_newest_is_latched() -> None:
    turned = KitObject("gear_part", Pose.from_rpy((0.1, -0.2, 0.3), (0.0, 0.0, math.pi / 2)))
    first = Order("order_0", (Kit("order_0_kit_0", (turned,)), Kit("order_0_kit_1", (turned,))), start_time=0.0)
    cell = at_rest(replace(KITTING, orders=(first, order(1, start_time=0.5)), extra_parts=()))
    ear = Ear(cell, "orders")
    assert len(ear) == 0
    start(cell)
    run(cell, 0.4)
    assert [message.order_id for message in ear.messages] == ["order_0"]
    message = ear.messages[0]
    assert [kit.kit_type for kit in message.kits] == ["order_0_kit_0", "order_0_kit_1"]
    part = message.kits[1].objects[0]
    p, q = part.pose.position, part.pose.orientation
    assert (part.type, p.x, p.y, p.z) == ("gear_part", 0.1, -0.2, 0.3)
    assert (q.x, q.y, q.z, q.w) == pytest.approx((0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)))
    run(cell, 1.0)
    assert [message.order_id for message in ear.messages] == ["order_0", "order_1"]
    late = Ear(cell, "orders")
    assert [message.order_id for message in late.messages] == ["order_1"]


def test_state_and_score_are_published_at_10_hz() -> None:
    cell = at_rest(KITTING)
    states, scores = Ear(cell, "competition_state"), Ear(cell, "current_score")
    run(cell, 0.2)
    start(cell)
    run(cell, 1.0)
    cell.agvs[1].send("order_0_kit_0")
    run(cell, 1.0)
    words = [message.data for message in states.messages]
    assert words[:2] == ["init", "init"]
    assert words[2:12] == ["go"] * 10
    assert words[-1] == "done"
    assert {message.data for message in scores.messages} == {0.0, 6.0}


def test_score_is_published_in_tick_of_kit() -> None:
    cell = at_rest(KITTING)
    scores, kits = Ear(cell, "current_score"), list[int]()
    cell.competition.on_effect.append(
        lambda effect: kits.append(cell.simulation.now) if isinstance(effect, KitSubmitted) else None
    )
    start(cell)
    run(cell, 1.03)
    cell.agvs[1].send("order_0_kit_0")
    while not kits:
        cell.simulation.step()
    assert cell.simulation.now % 100_000_000  # no sample is due
    assert scores.messages[-1].data == 6.0


@pytest.mark.slow
def test_agv_state_is_published_at_each_step_of_delivery() -> None:
    cell = at_rest(replace(KITTING, orders=()))
    ear, other = Ear(cell, "agv1/state"), Ear(cell, "agv2/state")
    cell.agvs[1].send("")
    run(cell, 19.2)
    words = [message.data for message in ear.messages]
    assert [word for index, word in enumerate(words) if index == 0 or words[index - 1] != word] == [
        "preparing_to_deliver",
        "delivering",
        "delivered",
        "returning",
        "ready_to_deliver",
    ]
    assert words.count("preparing_to_deliver") == 374  # 0.75 s, less the tick in which it departs
    assert words.count("delivering") == 4167
    assert words.count("delivered") == 1
    assert words.count("returning") == 5000
    assert {message.data for message in other.messages} == {"ready_to_deliver"}


def test_population_state_is_enabled_from_start_on() -> None:
    cell = at_rest(replace(WHOLE, orders=(order(0, start_time=5.0),)))
    ear = Ear(cell, "population/state")
    run(cell, 0.1)
    start(cell)
    run(cell, 0.1)
    assert [message.enabled for message in ear.messages] == [False] * 50 + [True] * 51


def test_clock_is_published_in_whole_nanoseconds() -> None:
    cell = Cell(replace(KITTING, settings=replace(KITTING.settings, timestep=(1, 240))))
    ear = Ear(cell, "/clock")
    for _ in range(240):
        cell.step()
    times = [message.clock.sec * 10**9 + message.clock.nanosec for message in ear.messages]
    assert times == [round(Fraction(n * 10**9, 240)) for n in range(1, 241)]


def test_reset_clears_latched_messages() -> None:
    cell = at_rest()
    latched = ("break_beam_1", "logical_camera_1", "quality_control_sensor_1", "orders")
    kept = [Ear(cell, name) for name in latched]
    start(cell)
    run(cell, 0.5)
    assert all(len(ear) for ear in kept)
    assert all(len(Ear(cell, name)) == 1 for name in latched)
    cell.reset()
    assert not any(len(Ear(cell, name)) for name in latched)
    assert len(Ear(cell, "/tf_static")) == 1


def test_restored_run_latches_order_of_its_snapshot() -> None:
    cell = at_rest(replace(KITTING, orders=(order(), order(1, start_time=0.5)), extra_parts=()))
    before = take_snapshot(cell.simulation)
    start(cell)
    run(cell, 0.3)
    between = take_snapshot(cell.simulation)
    run(cell, 0.5)
    for moment, newest in ((between, ["order_0"]), (before, [])):
        restore_snapshot(cell.simulation, moment)
        assert [message.order_id for message in Ear(cell, "orders").messages] == newest
        assert len(Ear(cell, "/tf_static")) == 1
