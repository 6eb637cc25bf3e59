"""Trial as a model: the parts in it, their names, and their places at the start."""

import dataclasses
from typing import Any

import mujoco
import numpy as np
import pytest

from cellwright.cell.model.build import World, build_world
from cellwright.cell.model.shelf import SHELF_SURFACE
from cellwright.config.sensors import PictureCameraConfig, SensorConfig
from cellwright.config.trial.trial import BeltPart, CellSettings, Kit, KitObject, Options, Order, Part, Trial
from cellwright.config.ur10 import GRIPPER
from cellwright.util.errors import UnknownNameError
from cellwright.util.pose import Pose
from tests.support.places import BIN_CENTRES, TRAY_IDS

TRAY = TRAY_IDS["agv1"]
BELT_TIMES = (BeltPart(3.0, "gear_part", Pose()), BeltPart(6.0, "part4", Pose()), BeltPart(9.0, "gear_part", Pose()))
ORDERS = (
    Order(
        "order_0",
        (
            Kit("order_0_kit_0", (KitObject("gear_part", Pose()), KitObject("disk_part", Pose()))),
            Kit("order_0_kit_1", (KitObject("gear_part", Pose()), KitObject("disk_part", Pose()))),
        ),
    ),
)
FULL = Trial(
    "full",
    has_arm=True,
    sensors=(
        SensorConfig("beam", "break_beam", Pose((1.6, 2.25, 0.91))),
        SensorConfig("eye", "logical_camera", Pose((0, 0, 2))),
    ),
    options=Options(belt_population_cycles=2, fill_demo_tray=True),
    orders=ORDERS,
    bin_parts=(
        Part("bin7|piston_rod_part_1", "piston_rod_part", Pose.from_rpy((-0.3, 0.03, 0.75), (0, 0, 0.8))),
        Part("bin8|gear_part_1", "gear_part", Pose((-0.3, 1.0, 0.75))),
    ),
    extra_parts=(Part("agv1|kit_tray_1|kit_tray_1|tray|part2_1", "part2", Pose((0.1, -0.2, 0.05)), TRAY),),
    belt_parts=BELT_TIMES,
)


@pytest.fixture(scope="module")
def world() -> World:
    return build_world(FULL)


def position(model: Any, body: str) -> Any:
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return data.body(body).xpos


def test_parts_in_play_come_before_pooled_parts(world: World) -> None:
    assert [(part.name, part.pooled) for part in world.parts] == [
        ("bin7|piston_rod_part_1", False),
        ("bin8|gear_part_1", False),
        ("agv1|kit_tray_1|kit_tray_1|tray|part2_1", False),
        ("populate_kit_tray_1|gear_part_clone_0", True),
        ("populate_kit_tray_1|disk_part_clone_0", True),
    ]
    assert {part.type for part in world.parts} == {"piston_rod_part", "gear_part", "part2", "disk_part"}


def test_bodies_for_clones_come_last(world: World) -> None:
    assert world.clones == (
        ("populate_conveyor|gear_part_clone_0", "gear_part"),
        ("populate_conveyor|gear_part_clone_1", "gear_part"),
        ("populate_conveyor|gear_part_clone_2", "gear_part"),
        ("populate_conveyor|gear_part_clone_3", "gear_part"),
        ("populate_conveyor|part4_clone_0", "part4"),
        ("populate_conveyor|part4_clone_1", "part4"),
    )
    assert [body.type for body in world.bodies] == ["gear_part"] * 4 + ["part4"] * 2
    assert [body.body for body in world.bodies] == sorted(body.body for body in world.bodies)
    assert world.bodies[0].body > world.parts[-1].body


def test_further_bodies_leave_ids_and_addresses_as_they_are(world: World) -> None:
    few, many = (build_world(FULL, ["part4", "gear_part", *more]) for more in ((), ("gear_part", "part4")))
    assert many.parts == few.parts == world.parts
    assert many.bodies[:2] == few.bodies
    assert many.model.nv == few.model.nv + 12
    names = [few.model.body(body).name for body in range(few.model.nbody)]
    assert [many.model.body(body).name for body in range(few.model.nbody)] == names


def test_part_addresses_lead_to_its_body_and_joint(world: World) -> None:
    model = world.model
    for part in (*world.parts, *world.bodies):
        assert model.body(part.body).name == part.name
        joint = model.joint(part.name)
        assert (joint.qposadr[0], joint.dofadr[0], joint.type[0]) == (part.qpos, part.dof, mujoco.mjtJoint.mjJNT_FREE)
        assert world.initial_qpos[part.qpos : part.qpos + 7] == pytest.approx(
            (*part.start.position, *part.start.quaternion)
        )
        assert part.geoms
        assert all(model.geom_bodyid[g] == part.body and model.geom_contype[g] == 2 for g in part.geoms)


def test_parts_have_inactive_grip_and_lock_welds(world: World) -> None:
    model = world.model
    assert not model.eq_active0.any()
    for part in (*world.parts, *world.bodies):
        for weld, name, holder in (
            (part.grips["arm"], "grip", GRIPPER),
            (part.locks[1], "lock1", TRAY_IDS["agv1"]),
            (part.locks[2], "lock2", TRAY_IDS["agv2"]),
        ):
            assert model.equality(weld).name == f"{name}|{part.name}"
            assert (model.eq_obj1id[weld], model.eq_obj2id[weld]) == (model.body(holder).id, part.body)
            assert model.eq_data[weld][10] == 1.0


def test_part_in_frame_starts_in_that_frame(world: World) -> None:
    part = next(each for each in world.parts if each.name == "agv1|kit_tray_1|kit_tray_1|tray|part2_1")
    assert part.start.position == pytest.approx((0.2, 3.35, 0.8), abs=1e-5)  # AGV 1 faces the other way


def test_pooled_parts_have_own_slots_above_floor(world: World) -> None:
    everything = (*world.parts, *world.bodies)
    slots = [part.shelf.position for part in everything]
    assert len(set(slots)) == len(slots)
    assert all(z >= SHELF_SURFACE for *_, z in slots)
    assert all(part.start == part.shelf for part in everything if part.pooled)


def test_world_without_arm_and_agvs_has_no_actuators() -> None:
    small = build_world(dataclasses.replace(FULL, has_arm=False, extra_parts=(), options=Options(insert_agvs=False)))
    assert small.model.nu == 0
    assert small.model.nv == 6 * (len(small.parts) + len(small.bodies))
    assert all(not part.grips and not part.locks for part in small.parts)
    assert not any(part.name.startswith("populate_kit_tray") for part in small.parts)
    with pytest.raises(KeyError):
        small.model.body("agv1")


def test_zero_cycles_leave_belt_empty() -> None:
    empty = build_world(dataclasses.replace(FULL, options=Options(belt_population_cycles=0)))
    assert not empty.clones
    assert not empty.bodies


def test_empty_trial_makes_empty_cell() -> None:
    empty = build_world(Trial("empty"))
    assert empty.parts == ()
    assert empty.model.nu == 8


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (Part("x|gaer_part_1", "gaer_part", Pose()), "unknown part type 'gaer_part'; did you mean gear_part"),
        (Part("x|gear_part_1", "gear_part", Pose(), "bin7:link"), "unknown frame 'bin7:link'; did you mean bin7::link"),
    ],
)
def test_unknown_type_or_frame_is_refused_with_suggestion(part: Part, message: str) -> None:
    with pytest.raises(UnknownNameError, match=message):
        build_world(Trial("bad", extra_parts=(part,)))


def test_tray_frame_without_agvs_is_refused() -> None:
    trial = Trial("bad", options=Options(insert_agvs=False), extra_parts=(Part("x|part2_1", "part2", Pose(), TRAY),))
    with pytest.raises(UnknownNameError, match="unknown frame"):
        build_world(trial)


def test_same_trial_makes_same_model() -> None:
    first, second = (build_world(FULL).model for _ in range(2))
    for name in ("body_pos", "geom_size", "geom_rgba", "mesh_vert", "eq_data", "dof_invweight0", "names"):
        assert np.array_equal(np.array(getattr(first, name)), np.array(getattr(second, name))), name


def test_put_in_first_pose_writes_all_positions(world: World) -> None:
    data = mujoco.MjData(world.model)
    data.qpos[:] = 7.0
    world.set_initial_posture(data)
    assert (data.qpos == world.initial_qpos).all()
    pan = world.model.actuator_ctrladr[world.model.actuator("shoulder_pan_joint").id]
    assert list(data.ctrl[pan : pan + 2]) == [3.14, 0.0]


def test_bins_trays_and_belt_are_at_original_poses(world: World) -> None:
    model = world.model
    for name, (x, y) in BIN_CENTRES.items():
        assert position(model, name)[:2] == pytest.approx((x, y))
    assert position(model, TRAY_IDS["agv1"]) == pytest.approx((0.3, 3.15, 0.75), abs=1e-6)
    assert position(model, TRAY_IDS["agv2"]) == pytest.approx((0.3, -3.15, 0.75), abs=1e-6)
    belt = model.geom("conveyor_belt")
    assert 2 * belt.size == pytest.approx((14.62206, 0.65461, 0.18862))


def test_geom_groups_follow_collision(world: World) -> None:
    """Group 1 collides and is drawn, 3 only collides; 4 is neither. What is only drawn is no geom."""
    model = world.model
    solid = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    assert set(model.geom_group[solid]) == {1, 3}
    assert set(model.geom_group[~solid]) == {4}


def test_timestep_sets_stiffness_of_contacts() -> None:
    for numerator, denominator, expected in ((1, 1000, 0.004), (1, 500, 0.004), (1, 250, 0.008)):
        model = build_world(Trial("t", settings=CellSettings(timestep=(numerator, denominator)))).model
        assert model.opt.timestep == pytest.approx(numerator / denominator)
        assert model.geom("conveyor_belt").solref == pytest.approx((expected, 1.0))


def test_model_has_only_bodies_that_are_touched_or_move(world: World) -> None:
    model = world.model
    for body in range(1, model.nbody):
        assert model.body_geomnum[body], model.body(body).name


def test_visuals_are_on_bodies_of_model(world: World) -> None:
    model, shapes = world.model, world.visuals.shapes
    assert {"world", "agv1", "bin3", "vacuum_gripper_link", "bin8|gear_part_1"} <= {body for body, _ in shapes}
    for body, shape in shapes:
        assert model.body(body).id >= 0
        assert (shape.mesh in world.visuals.meshes) == (shape.kind == "mesh")


def test_sensor_housings_are_visuals_at_their_sensors(world: World) -> None:
    places = np.array([shape.pose.position for body, shape in world.visuals.shapes if body == "world"])
    for sensor in FULL.sensors:
        distances = np.linalg.norm(places - sensor.pose.position, axis=1)
        assert (distances < 0.07).sum() == 2


def test_housing_of_camera_moves_with_its_link() -> None:
    camera = PictureCameraConfig("wrist", "rgb_camera", Pose((0.0, 0.0, 0.1)), frame="wrist_3_link")
    worlds = [build_world(Trial("t", has_arm=True, sensors=sensors)) for sensors in ((), (camera,))]
    bare, dressed = ([shape for body, shape in each.visuals.shapes if body == "wrist_3_link"] for each in worlds)
    assert len(dressed) - len(bare) == 2
    assert worlds[0].model.nbody == worlds[1].model.nbody
