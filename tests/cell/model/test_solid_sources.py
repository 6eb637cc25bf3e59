"""Every solid shape of a cell, with its source in the original: nothing else may be solid."""

import json
from collections import Counter
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from cellwright.cell.model.build import World, build_world
from cellwright.cell.model.parts import PART_TYPES
from cellwright.config.sensors import SensorConfig
from cellwright.config.trial.trial import Part, Trial
from cellwright.config.trial.values import SENSOR_TYPES
from cellwright.util.pose import Pose
from tests.conftest import DATA

LINKS = json.loads((DATA / "ur10_link_outlines.json").read_text())["links"]
PHYSICS = " ".join((DATA.parents[1] / "docs" / "physics.md").read_text().split())
EXACT = 0.0002
"""Rounding [m] of the figures below."""
OUTLINE = 0.0021
"""Maximum distance [m] of the arm's shapes from the original's meshes."""

Box = tuple[float, float, float, float, float, float]


class Source(NamedTuple):
    """Solids of the original, and the shapes that stand for them.

    Attributes:
        body: name of the body, with wildcards.
        number: number of our shapes for them on each such body.
        boxes: bounding boxes of the original's shapes in the body's frame [m]: lowest and highest x, y and z.
        source: origin of the figures.
        outside: distance [m] by which one of our shapes sticks out of its box.
        difference: the words of docs/physics.md about that, where it is no rounding.
    """

    body: str
    number: int
    boxes: tuple[Box, ...]
    source: str
    outside: float = EXACT
    difference: str = ""


def around(x: float, y: float, z: float, at: tuple[float, float, float]) -> Box:
    """Return the box with these edge lengths [m] around a centre."""
    return (at[0] - x / 2, at[0] + x / 2, at[1] - y / 2, at[1] + y / 2, at[2] - z / 2, at[2] + z / 2)


def upright(radius: float, low: float, high: float, x: float = 0.0, y: float = 0.0) -> Box:
    """Return the box around an upright cylinder [m]."""
    return (x - radius, x + radius, y - radius, y + radius, low, high)


def link(name: str) -> Box:
    """Return the box around a link's collision mesh."""
    low, high = LINKS[name]["box"]
    return (low[0], high[0], low[1], high[1], low[2], high[2])


MESH = "collision mesh {} of the UR10's robot description"
PART = "model of {}"
SIDES = (-1.0, 1.0)
TRAY = "agv?::kit_tray_?::kit_tray_?::tray"

SOURCES = (
    Source("world", 1, (), "world template: ground plane"),
    Source("linear_arm_actuator", 1, (around(0.2, 4.6, 0.1, (0, 0, 0)),), "robot template: linear_arm_actuator"),
    Source("base_link", 2, (link("base"),), MESH.format("base"), OUTLINE),
    Source("shoulder_link", 2, (link("shoulder"),), MESH.format("shoulder"), OUTLINE),
    Source("upper_arm_link", 5, (link("upperarm"),), MESH.format("upperarm"), OUTLINE),
    Source("forearm_link", 4, (link("forearm"),), MESH.format("forearm"), OUTLINE),
    Source("wrist_1_link", 2, (link("wrist1"),), MESH.format("wrist1"), OUTLINE),
    Source("wrist_2_link", 2, (link("wrist2"),), MESH.format("wrist2"), OUTLINE),
    Source("wrist_3_link", 1, (link("wrist3"),), MESH.format("wrist3"), OUTLINE),
    Source("vacuum_gripper_link", 1, (upright(0.05, -0.005, 0.005),), "vacuum_gripper.urdf.xacro: disc"),
    Source(
        "bin?", 1, ((-0.3, 0.3, -0.3, 0.3, 0.2005, 0.725),), "model of the bin: support, thickness not known", 0.0175,
        "floors of bins reach to the walls",
    ),
    Source(
        "bin?", 4, tuple(around(0.003, 0.641, 0.59039, (0.319 * side, 0, 0.495695)) for side in SIDES),
        "model of the bin: sides", 0.005, "walls of bins are 8 mm thick",
    ),
    Source(
        "bin?", 8,
        tuple(around(0.134, 0.003, 0.59039, (0.2535 * x, 0.319 * y, 0.495695)) for x in SIDES for y in SIDES),
        "model of the bin: corners", 0.005, "walls of bins are 8 mm thick",
    ),
    Source(
        "conveyor_belt", 1, (around(14.62206, 0.65461, 0.18862, (0, 0, 0)),), "model of the conveyor belt"
    ),
    Source(
        "camera_frame_?", 3,
        (around(0.05, 3.5, 0.05, (0, -0.25, 2.0)), *(around(0.05, 0.05, 2.0, (0, y, 1.0)) for y in (-2.0, 1.5))),
        "model of the workcell: camera frame",
    ),
    Source(
        "conveyor_frame", 12,
        (around(0.05, 10.0, 0.05, (0, 0, 0.95)), *(around(0.05, 0.05, 3.0, (0, y, 1.5)) for y in range(-5, 6))),
        "model of the workcell: conveyor frame",
    ),
    Source("conveyor_beam", 1, (around(0.05, 10.0, 0.05, (0, 0, 0)),), "model of the workcell: conveyor frame"),
    Source("shelf", 1, (), "none: it is ours", np.inf, "a shelf 40 m from the cell"),
    Source(
        "agv?", 4,
        (
            around(0.555, 1.023, 0.409, (0, 0, 0.3045)),
            around(0.673, 1.171, 0.124, (0, 0, 0.162)),
            upright(0.087, 0.0, 0.875, 0.0, -0.275),
            upright(0.043, 0.0, 1.408, 0.0, -0.275),
        ),
        "model of the AGV",
    ),
    Source(
        TRAY, 1, (around(0.5, 0.7, 0.01, (0, 0, 0)),), "model of the kit tray: plate", 0.07,
        "plates of trays are 8 cm thick",
    ),
    Source(
        TRAY, 12,
        (
            *(around(0.001, 0.7, 0.0254, (0.25 * side, 0, 0.0127)) for side in SIDES),
            *(around(0.5, 0.001, 0.0254, (0, 0.35 * side, 0.0127)) for side in SIDES),
        ),
        "model of the kit tray: rims", 0.0058, "rims of trays are 7 mm thick",
    ),
    Source(
        "bin7|gear_part_1", 2, (upright(0.0392, -0.0001, 0.0119), upright(0.0039, 0.0, 0.015, 0.0, 0.021)),
        PART.format("gear_part"),
    ),
    Source(
        "bin7|disk_part_1", 2, (upright(0.0627, 0.0, 0.02316), upright(0.0039, 0.0, 0.026, 0.03, 0.03)),
        PART.format("disk_part"),
    ),
    Source("bin7|gasket_part_1", 5, (around(0.188, 0.086, 0.025, (0, 0, 0.0125)),), PART.format("gasket_part")),
    Source(
        "bin7|piston_rod_part_1", 2,
        (around(0.059, 0.052, 0.0075, (0, 0, 0.00375)), around(0.031, 0.11, 0.0075, (0, 0.08, 0.00375))),
        PART.format("piston_rod_part"),
    ),
    Source(
        "bin7|pulley_part_1", 1, (upright(0.1, 0.0, 0.07),), PART.format("pulley_part"), 0.0125,
        "the groove of a pulley is filled",
    ),
    Source("bin7|part1_1", 1, (around(0.3008, 0.1023, 0.015, (0, 0, 0)),), PART.format("part1")),
    Source("bin7|part2_1", 1, (around(0.06, 0.015, 0.01, (0, 0, 0.005)),), PART.format("part2")),
    Source("bin7|part3_1", 1, (around(0.1357, 0.1454, 0.02, (0.03, 0.03, 0.01)),), PART.format("part3")),
    Source("bin7|part4_1", 1, (around(0.09, 0.0601, 0.0103, (0, 0, 0)),), PART.format("part4")),
)  # fmt: skip
"""Sources of all solids, with figures of the original's files: those of ARIAC 2017, release 1.1.4."""


@pytest.fixture(scope="module")
def world() -> World:
    """A cell with an arm, AGVs, a part of each type and a sensor of each type."""
    parts = tuple(Part(f"bin7|{kind}_1", kind, Pose((0.0, 0.0, 1.0))) for kind in PART_TYPES)
    sensors = tuple(SensorConfig(f"a_{kind}", kind, Pose((0.0, 0.0, 2.5))) for kind in SENSOR_TYPES)
    return build_world(Trial("", has_arm=True, bin_parts=parts, sensors=sensors))


def solid_geoms(model: Any) -> list[int]:
    return [geom for geom in range(model.ngeom) if model.geom_contype[geom] or model.geom_conaffinity[geom]]


def body_of(model: Any, geom: int) -> str:
    return str(model.body(int(model.geom_bodyid[geom])).name)


def reach(model: Any, geom: int) -> NDArray[np.float64]:
    """Return lowest and highest x, y and z of a shape in the frame of its body [m], shape (3, 2)."""
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, model.geom_quat[geom])
    turn = flat.reshape(3, 3)
    centre: NDArray[np.float64] = np.array(model.geom_pos[geom])[:, None]
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        first = int(model.mesh_vertadr[mesh])
        corners: NDArray[np.float64] = model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])] @ turn.T
        ends: NDArray[np.float64] = np.stack([corners.min(axis=0), corners.max(axis=0)], axis=1)
        return centre + ends
    half: NDArray[np.float64]
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        half = np.abs(turn) @ size
    else:
        assert kind in (mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_CAPSULE)
        along = np.abs(turn[:, 2])
        round_off = 1.0 if kind == mujoco.mjtGeom.mjGEOM_CAPSULE else np.sqrt(np.maximum(0.0, 1 - along**2))
        half = along * size[1] + size[0] * round_off
    return centre + np.stack([-half, half], axis=1)


def outside(shape: NDArray[np.float64], box: Box) -> float:
    """Return how far [m] a shape sticks out of a box."""
    low, high = np.array(box).reshape(3, 2).T
    return float(max((low - shape[:, 0]).max(), (shape[:, 1] - high).max()))


def sources_of(model: Any, geom: int) -> list[tuple[float, Source]]:
    """Return the sources that a shape may have, each with how far [m] it sticks out, the best one first."""
    found = []
    for source in SOURCES:
        if fnmatchcase(body_of(model, geom), source.body):
            distance = min((outside(reach(model, geom), box) for box in source.boxes), default=0.0)
            found.append((distance, source))
    return sorted(found, key=lambda each: (each[0] > each[1].outside + EXACT, each[0]))


def test_every_solid_has_a_source(world: World) -> None:
    model = world.model
    counts: Counter[tuple[str, Source]] = Counter()
    for geom in solid_geoms(model):
        body = body_of(model, geom)
        found = sources_of(model, geom)
        assert found, f"{body!r} is solid without a source"
        counts[body, found[0][1]] += 1
    for (body, source), count in counts.items():
        assert count == source.number, (body, source.source)
    assert {source for _, source in counts} == set(SOURCES)


def test_no_solid_sticks_out_of_its_source(world: World) -> None:
    model = world.model
    farthest: dict[Source, float] = {}
    for geom in solid_geoms(model):
        distance, source = sources_of(model, geom)[0]
        assert distance <= source.outside + EXACT, (body_of(model, geom), source.source, distance)
        farthest[source] = max(farthest.get(source, 0.0), distance)
    for source, distance in farthest.items():
        if source.difference and source.boxes:
            assert distance == pytest.approx(source.outside, abs=EXACT), source.source


@pytest.mark.parametrize(
    "source", [source for source in SOURCES if source.outside > OUTLINE], ids=lambda each: each.body
)
def test_differences_from_sources_are_in_the_docs(source: Source) -> None:
    assert source.difference
    assert source.difference in PHYSICS


def test_solids_without_source_are_seen_only(world: World) -> None:
    bodies = {body for body, _ in world.visuals.shapes}
    assert {"base_link", "bin1", "conveyor_belt", "world", "agv1"} <= bodies
    carriage = [shape for body, shape in world.visuals.shapes if body == "base_link" and shape.size[1] == 0.17]
    assert len(carriage) == 1
