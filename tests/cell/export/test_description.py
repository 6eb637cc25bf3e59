"""Description of a whole cell: read again, its links stand where the engine has them, in any posture."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from cellwright import load_trial
from cellwright.cell.export.description import CellDescription, cell_description
from cellwright.cell.export.moveit import read_package
from cellwright.cell.model.build import World, build_world
from cellwright.config.layout.arm_models import chain_in_engine
from cellwright.config.layout.arms import Mount
from cellwright.config.models.meshes import read_mesh
from cellwright.config.models.model import Furniture, ModelShape, UserModel
from cellwright.config.robot.model import RobotModel, link_poses
from cellwright.config.trial.trial import Trial
from cellwright.util.pose import Pose
from tests.cell.arm_cells import TWO_ON_A_RAIL, TWO_UR5, ur5_cell
from tests.support.urdfdom import complaints, lacking

MADE = "cellwright_moveit_config"
HEAP = Pose.from_rpy((1.0, 2.0, 0.3), (0.0, 0.4, 1.0))
PYRAMID = "v 0 0 0\nv .4 0 0\nv 0 .4 0\nv .1 .1 .6\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n"


def on_rail() -> Trial:
    """Return a cell whose UR5 is on a rail that is turned."""
    trial = ur5_cell()
    (arm,) = trial.arms
    rail = Mount("rail", Pose.from_rpy((0.2, 0.1, 0.5), (0.0, 0.0, 0.7)), range=(-0.5, 0.5))
    return replace(trial, layout=replace(trial.layout, arms=(replace(arm, mount=rail),)))


def of_2017() -> Trial:
    return load_trial("final01", "kitter_sensors")


def two_ur5() -> Trial:
    return ur5_cell(TWO_UR5)


def two_of_2017() -> Trial:
    return load_trial(text=TWO_ON_A_RAIL)


CELLS = [of_2017, ur5_cell, on_rail, two_ur5, two_of_2017]


def with_furniture(folder: Path) -> Trial:
    """Return a cell with a piece of furniture whose shape is a mesh."""
    path = folder / "pyramid.obj"
    path.write_text(PYRAMID)
    shape = ModelShape("mesh", (1.0, 1.0, 1.0), mesh=path)
    return replace(ur5_cell(), furniture=(Furniture("heap", UserModel((shape,)), HEAP),))


def described(trial: Trial, folder: Path) -> tuple[World, CellDescription, RobotModel]:
    world = build_world(trial)
    found = cell_description(trial, world, MADE)
    return world, found, read_package(folder, found)


@pytest.mark.parametrize("make", CELLS)
def test_links_are_where_the_engine_has_their_bodies(make: Callable[[], Trial], tmp_path: Path) -> None:
    trial = make()
    world, found, robot = described(trial, tmp_path)
    chains = {arm: chain_in_engine(arm, trial.arm_models) for arm in trial.arms}
    bodies = dict(found.bodies) | {arm.frame_of(name): name for arm, chain in chains.items() for name in chain.links}
    assert set(bodies) <= set(robot.links)
    random, data = np.random.default_rng(7), world.initial_data()
    limits = {joint.name: joint.limits for chain in chains.values() for joint in chain.driven}
    names = {joint.name: arm.frame_of(joint.name) for arm, chain in chains.items() for joint in chain.driven}
    for _ in range(20):
        posture = {name: random.uniform(max(each.lower, -6.0), min(each.upper, 6.0)) for name, each in limits.items()}
        for name, position in posture.items():
            data.joint(name).qpos[0] = position
        mujoco.mj_kinematics(world.model, data)
        poses = link_poses(robot, {names[name]: each for name, each in posture.items()})
        for link, body in bodies.items():
            rotation = np.array([poses[link].rotate(axis) for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]).T
            assert np.allclose(poses[link].position, data.body(body).xpos, rtol=0, atol=1e-9), link
            assert np.allclose(rotation, data.body(body).xmat.reshape(3, 3), rtol=0, atol=1e-9), link


def test_what_stands_in_the_cell_is_solid() -> None:
    trial = of_2017()
    found = cell_description(trial, build_world(trial), MADE)
    assert {"bin1", "bin8", "conveyor_belt", "agv1", "agv2_kit_tray_2_kit_tray_2_tray", "floor"} <= set(found.bodies)
    links = {link.attrib["name"]: link for link in ET.fromstring(found.urdf).iter("link")}
    assert not [name for name in found.bodies if links[name].find("collision") is None]
    assert not any("part" in name for name in found.bodies)
    assert set(found.bodies).isdisjoint({"linear_arm_actuator", "shelf"})


def test_floor_is_a_plate_that_reaches_beyond_everything(tmp_path: Path) -> None:
    _, _, robot = described(ur5_cell(), tmp_path)
    (plate, *_), pedestal = robot.links["floor"].shapes, robot.links["arm_pedestal"].shapes[0]
    poses = link_poses(robot, {})
    middle, half = (poses["floor"] @ plate.pose).position, np.array(plate.size) / 2
    assert middle[2] + half[2] == pytest.approx(0.0)
    at = (poses["arm_pedestal"] @ pedestal.pose).position
    assert (np.abs(np.subtract(at, middle))[:2] + 2.0 < half[:2]).all()


def test_meshes_are_files_of_the_package(tmp_path: Path) -> None:
    _, found, robot = described(with_furniture(tmp_path), tmp_path)
    (path,) = found.meshes
    assert path == "meshes/heap_0.stl"
    assert f'"package://{MADE}/{path}"' in found.urdf
    (shape, *_) = robot.links["heap"].shapes
    assert shape.mesh is not None
    world_T_heap = link_poses(robot, {})["heap"]
    corners = {
        tuple(np.round((world_T_heap @ shape.pose).transform(tuple(each)), 5)) for each in read_mesh(shape.mesh)[0]
    }
    written = [tuple(map(float, line.split()[1:])) for line in PYRAMID.splitlines() if line.startswith("v")]
    assert corners == {tuple(np.round(HEAP.transform((x, y, z)), 5)) for x, y, z in written}
    assert found.bodies["heap"] == "furniture|heap"


def test_body_with_the_name_of_a_link_gets_another(tmp_path: Path) -> None:
    piece = Furniture("tool0", UserModel((ModelShape("box", (0.1, 0.1, 0.1)),)), HEAP)
    _, found, robot = described(replace(ur5_cell(), furniture=(piece,)), tmp_path)
    assert found.bodies["tool0_2"] == "furniture|tool0"
    assert {"tool0", "tool0_2"} <= set(robot.links)


@pytest.mark.skipif(lacking() is not None, reason=lacking() or "")
@pytest.mark.parametrize("make", CELLS)
def test_parser_of_ros_accepts_the_description(make: Callable[[], Trial]) -> None:
    trial = make()
    assert complaints(cell_description(trial, build_world(trial), MADE).urdf) == []


def test_description_has_no_newer_forms_of_urdf() -> None:
    trial = ur5_cell()
    text = cell_description(trial, build_world(trial), MADE).urdf
    assert "quat" not in text
    assert "capsule" not in text
