from __future__ import annotations

import itertools
import math

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.cell.devices.scene import collision_geoms
from cellwright.util.pose import Pose
from tests.cell.devices.scene import CYLINDER, add_agv, add_block, add_part, empty_spec, make_simulation, move, scene_of

turns = st.tuples(*[st.floats(-math.pi, math.pi)] * 3)


@settings(max_examples=50)
@given(turns)
def test_bounds_of_box_reach_its_corners(rpy: tuple[float, float, float]) -> None:
    half, pose = (0.03, 0.05, 0.01), Pose.from_rpy((1.0, 2.0, 3.0), rpy)
    spec = empty_spec()
    add_part(spec, "part1_0", pose, half, centre=(0.1, 0.0, 0.02))
    simulation = make_simulation(spec)
    centres, halves = scene_of(simulation, ("part1_0", "part1")).boxes()
    signs = itertools.product((-1, 1), repeat=3)
    corners = np.array([pose.transform((0.1 + a * half[0], b * half[1], 0.02 + c * half[2])) for a, b, c in signs])
    assert centres[0] - halves[0] == pytest.approx(corners.min(axis=0), abs=1e-9)
    assert centres[0] + halves[0] == pytest.approx(corners.max(axis=0), abs=1e-9)


@settings(max_examples=50)
@given(turns)
def test_bounds_of_cylinder_reach_its_rims(rpy: tuple[float, float, float]) -> None:
    radius, half_height, pose = 0.0392, 0.006, Pose.from_rpy((0.5, -1.0, 0.9), rpy)
    spec = empty_spec()
    add_part(spec, "gear_part_1", pose, (radius, half_height, 0.0), CYLINDER)
    simulation = make_simulation(spec)
    centres, halves = scene_of(simulation, ("gear_part_1", "gear_part")).boxes()
    rims = np.array(
        [
            pose.transform((radius * math.cos(a), radius * math.sin(a), z))
            for a in np.linspace(0, 2 * math.pi, 720, endpoint=False)
            for z in (-half_height, half_height)
        ]
    )
    assert centres[0] - halves[0] == pytest.approx(rims.min(axis=0), abs=2e-6)
    assert centres[0] + halves[0] == pytest.approx(rims.max(axis=0), abs=2e-6)


def test_bounds_of_sphere_are_cube_in_any_rotation() -> None:
    spec = empty_spec()
    add_part(spec, "part1_0", Pose.from_rpy((0, 0, 1), (0.4, 0.5, 0.6)), (0.1, 0, 0), mujoco.mjtGeom.mjGEOM_SPHERE)
    simulation = make_simulation(spec)
    _, halves = scene_of(simulation, ("part1_0", "part1")).boxes()
    assert halves[0] == pytest.approx([0.1, 0.1, 0.1], abs=1e-12)


def test_model_of_many_geoms_has_one_box_around_solid_geoms() -> None:
    spec = empty_spec()
    add_part(spec, "gear_part_1", Pose((0, 0, 5)))
    add_agv(spec, 1, (0.3, 3.3, 0.0), (0.0, 0.0, 0.0, 1.0))
    add_part(spec, "gear_part_2", Pose((0, 0, 7)))
    simulation = make_simulation(spec)
    scene = scene_of(
        simulation,
        ("gear_part_1", "gear_part"),
        ("agv1", "agv1"),
        ("kit_tray_1", "kit_tray"),
        ("gear_part_2", "gear_part"),
    )
    centres, halves = scene.boxes()
    lower, upper = centres - halves, centres + halves
    assert lower[0] == pytest.approx([-0.05, -0.05, 4.95])
    assert lower[1] == pytest.approx([0.3 - 0.28, 3.3 - 0.51, 0.0])
    assert upper[1] == pytest.approx([0.3 + 0.28, 3.3 + 0.51, 0.875])
    assert lower[2] == pytest.approx([0.05, 2.8, 0.745])
    assert upper[2] == pytest.approx([0.55, 3.5, 0.755])
    assert upper[3] == pytest.approx([0.05, 0.05, 7.05])
    assert scene.nested_in.tolist() == [0, 1, 1, 3]


def test_collision_geoms_are_colliding_geoms_of_body_tree() -> None:
    spec = empty_spec()
    add_agv(spec, 1, (0, 0, 0))
    add_part(spec, "gear_part_1", Pose())
    add_block(spec, (3, 0, 0), (1, 1, 1))
    model = spec.compile()
    agv = collision_geoms(model, model.body("agv1").id)
    assert len(agv) == 3
    assert model.geom("kit_tray_1_plate").id in agv
    tray = collision_geoms(model, model.body("agv1::kit_tray_1::kit_tray_1::tray").id)
    assert tray == (model.geom("kit_tray_1_plate").id,)
    assert len(collision_geoms(model, model.body("gear_part_1").id)) == 1


def test_boxes_and_poses_are_those_of_saved_state() -> None:
    spec = empty_spec()
    add_part(spec, "part1_0", Pose(), (0.1, 0.02, 0.02))
    simulation = make_simulation(spec)
    scene = scene_of(simulation, ("part1_0", "part1"))
    first = scene.save()
    assert scene.boxes()[0] is scene.boxes(first)[0]  # nothing moved, so nothing is computed again
    move(simulation, "part1_0", Pose((0.0, 0.0, 1.0)))  # also within a tick
    second = scene.save()
    move(simulation, "part1_0", Pose.from_rpy((0.0, 0.0, 1.0), (0, 0, math.pi / 2)))
    third = scene.save()
    assert scene.boxes(second)[0][0] == pytest.approx([0, 0, 1])
    assert scene.boxes(third)[1][0] == pytest.approx([0.02, 0.1, 0.02])
    assert scene.boxes(first)[0][0] == pytest.approx([0, 0, 0])
    assert scene.poses(np.array([0]), second) == [Pose((0.0, 0.0, 1.0))]


def test_saved_state_is_shared_until_something_moves() -> None:
    spec = empty_spec()
    add_part(spec, "part1_0", Pose(), (0.1, 0.02, 0.02))
    simulation = make_simulation(spec)
    scene = scene_of(simulation, ("part1_0", "part1"))
    first = scene.save()
    assert scene.save() is first
    move(simulation, "part1_0", Pose((0.0, 0.0, 1.0)))
    assert scene.save() is not first


def test_empty_scene_has_no_boxes() -> None:
    simulation = make_simulation(empty_spec())
    centres, halves = scene_of(simulation).boxes()
    assert centres.shape == halves.shape == (0, 3)
