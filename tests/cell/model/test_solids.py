"""Solid shapes of a cell, against its model."""

import math
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.cell import Cell
from cellwright.cell.model.build import World, build_world
from cellwright.cell.model.solids import solids
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.config.arm import ARM_FRAMES, ARM_JOINTS
from cellwright.config.models.model import Furniture, ModelShape, UserModel
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Options, Part, Trial
from cellwright.motion import Joints, link_poses
from cellwright.util.pose import Pose
from tests.support.cells import BARE, ROD_IN_REACH
from tests.support.own_parts import write_trial
from tests.support.places import LAYOUT

turns = st.floats(-3.1, 3.1)
postures = st.builds(Joints, st.floats(-2.1, 2.1), turns, turns, turns, turns, turns, turns)


@pytest.fixture(scope="module")
def world() -> World:
    """An arm, bins, belt and AGVs."""
    return build_world(Trial("", has_arm=True))


def pose(shape: dict[str, Any]) -> Pose:
    return Pose(tuple(shape["position"]), tuple(shape["quaternion"]))


def solid_geoms(world: World) -> list[int]:
    model = world.model
    parts = {part.body for part in (*world.parts, *world.bodies)}
    is_solid = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    return [geom for geom in range(model.ngeom) if is_solid[geom] and model.geom_bodyid[geom] not in parts]


@given(joints=postures)
def test_shapes_are_where_the_model_has_them_in_any_posture(world: World, joints: Joints) -> None:
    model = world.model
    data = mujoco.MjData(model)
    world.set_initial_posture(data)
    data.qpos[[int(model.joint(name).qposadr[0]) for name in ARM_JOINTS]] = joints
    mujoco.mj_kinematics(model, data)
    frames = {"world": Pose(), **link_poses(joints)}
    found = [
        (shape["body"], frames[frame] @ pose(shape)) for frame, shapes in solids(world).items() for shape in shapes
    ]
    expected = [(model.body(int(model.geom_bodyid[geom])).name, geom) for geom in solid_geoms(world)]
    names = {name for name, _ in expected} - {"shelf"}
    assert names == {name for name, _ in found}
    assert names >= {"world", *ARM_FRAMES, "bin7", "conveyor_belt", "agv1"}
    for name in names:
        ours = [each for body, each in found if body == name]
        theirs = [geom for body, geom in expected if body == name]
        assert len(ours) == len(theirs), name
        for mine, geom in zip(ours, theirs, strict=True):
            assert mine.position == pytest.approx(data.geom_xpos[geom], abs=1e-5)
            rotation = np.zeros(9)
            mujoco.mju_quat2Mat(rotation, np.array(mine.quaternion))
            assert rotation == pytest.approx(data.geom_xmat[geom], abs=1e-5)


def test_sizes_are_those_of_the_model(world: World) -> None:
    shapes = [shape for each in solids(world).values() for shape in each]
    assert {shape["type"] for shape in shapes} == {"plane", "box", "cylinder", "capsule", "mesh"}
    model = world.model
    (belt,) = [geom for geom in solid_geoms(world) if model.geom(geom).name == "conveyor_belt"]
    (shape,) = [shape for shape in shapes if shape["body"] == "conveyor_belt"]
    assert shape["size"] == pytest.approx(model.geom_size[belt], abs=1e-6)
    assert {len(shape["size"]) for shape in shapes if shape["type"] in ("cylinder", "capsule")} == {2}
    assert {len(shape["size"]) for shape in shapes if shape["type"] in ("plane", "mesh")} == {0}


def test_meshes_are_their_convex_hulls(world: World) -> None:
    model = world.model
    meshes = [shape for each in solids(world).values() for shape in each if shape["type"] == "mesh"]
    geoms = [geom for geom in solid_geoms(world) if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH]
    assert len(meshes) == len(geoms) > 0
    directions = np.random.default_rng(5).normal(size=(100, 3))
    for shape, geom in zip(meshes, geoms, strict=True):
        mesh = int(model.geom_dataid[geom])
        first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        whole = (model.mesh_vert[first : first + count] @ directions.T).max(axis=0)
        assert (np.array(shape["vertices"]) @ directions.T).max(axis=0) == pytest.approx(whole, abs=1e-5)


def test_triangles_enclose_the_convex_hull(world: World) -> None:
    meshes = [shape for each in solids(world).values() for shape in each if shape["type"] == "mesh"]
    for shape in meshes:
        vertices, triangles = np.array(shape["vertices"]), np.array(shape["triangles"])
        assert len(triangles) == 2 * len(vertices) - 4, "a closed surface"
        assert set(triangles.ravel()) == set(range(len(vertices)))
        first, second, third = (vertices[triangles[:, number]] for number in range(3))
        outward = np.cross(second - first, third - first)
        outward /= np.linalg.norm(outward, axis=1)[:, None]
        heights = outward @ vertices.T - (outward * first).sum(axis=1)[:, None]
        assert heights.max() < 1e-5, "no vertex lies outside a triangle"


def test_frames_are_links_that_the_arm_moves(world: World) -> None:
    assert list(solids(world)) == ["world", *ARM_FRAMES[1:]]
    assert list(solids(build_world(BARE))) == ["world"]
    rail = [shape for shape in solids(world)["world"] if shape["body"] == ARM_FRAMES[0]]
    assert rail, "it stands still"


def test_parts_are_not_among_shapes(world: World) -> None:
    tray = next(iter(LAYOUT.tray_frames))
    parts = (ROD_IN_REACH, Part("tray1|gear_part_1", "gear_part", Pose((0.1, 0.1, 0.006)), tray))
    assert solids(build_world(Trial("", has_arm=True, bin_parts=parts))) == solids(world)


def test_agvs_are_at_their_load_points(world: World) -> None:
    shapes = solids(world)["world"]
    for number, (tray, frame) in enumerate(LAYOUT.tray_frames.items(), 1):
        (plate,) = [shape for shape in shapes if shape["body"] == tray and shape["type"] == "box"]
        assert plate["position"][:2] == pytest.approx(frame.position[:2], abs=1e-3)
        base = [shape["position"] for shape in shapes if shape["body"] == f"agv{number}"]
        assert min(math.dist(place[:2], frame.position[:2]) for place in base) < 0.2
    without = build_world(Trial("", has_arm=True, options=Options(insert_agvs=False)))
    assert not [shape for shape in solids(without)["world"] if "agv" in shape["body"]]


def test_own_furniture_is_among_shapes_as_far_as_solid() -> None:
    shelf = UserModel((ModelShape("box", (0.6, 0.3, 0.7), Pose((0.0, 0.0, 0.35))),))
    ball = UserModel((ModelShape("sphere", (0.2, 0.0, 0.0)), ModelShape("sphere", (0.5, 0.0, 0.0), is_touched=False)))
    pieces = (Furniture("shelf", shelf, Pose((-0.3, -2.2, 0.0))), Furniture("ball", ball, Pose((1.0, 2.0, 3.0))))
    found = [
        (shape["body"], shape["type"], shape["position"], shape["size"])
        for shape in solids(build_world(Trial("", furniture=pieces)))["world"]
        if shape["body"].startswith("furniture")
    ]
    assert found == [
        ("furniture|shelf", "box", pytest.approx([-0.3, -2.2, 0.35]), pytest.approx([0.3, 0.15, 0.35])),
        ("furniture|ball", "sphere", pytest.approx([1.0, 2.0, 3.0]), pytest.approx([0.2])),
    ]


def test_solids_of_running_cell_are_those_of_its_start(tmp_path: Path) -> None:
    """So the answer is the same for every client, and its parts that are put into play change nothing."""
    cell = Cell(load_trial([write_trial(tmp_path, "my_can")]).trial)
    first = solids(cell.world)
    client = Client(InProcess(cell))
    client.sleep(0.1)
    assert client.control_agv(1, "kit")
    client.sleep(4.0)
    assert cell.agvs[1].state != "ready_to_deliver"
    assert solids(cell.world) == first
