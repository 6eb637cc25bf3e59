from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.config.models.meshes import read_mesh
from cellwright.config.models.model import ModelShape
from cellwright.config.robot.model import link_poses
from cellwright.util.errors import DescriptionError
from tests.config.robot.mjcf_robots import Moved, quiet, rotation, write

NUMBERS = st.floats(-2, 2).map(lambda number: round(number, 3))
SCALES = NUMBERS.filter(lambda number: abs(number) > 0.1)


def shapes(folder: Path, geoms: str, before: str = "") -> tuple[ModelShape, ...]:
    path = write(folder, f'{before}<worldbody><body name="a">{geoms}</body></worldbody>')
    return quiet(path).model.links["a"].shapes


def test_sizes_are_whole_lengths(tmp_path: Path) -> None:
    found = shapes(
        tmp_path,
        '<geom type="box" size=".1 .2 .3"/><geom size=".1"/><geom type="cylinder" size=".1 .2"/>'
        '<geom type="capsule" size=".1" fromto="0 0 0 0 0 1"/>',
    )
    assert [(shape.kind, shape.size) for shape in found] == [
        ("box", (0.2, 0.4, 0.6)),
        ("sphere", (0.1, 0.0, 0.0)),
        ("cylinder", (0.1, 0.4, 0.0)),
        ("capsule", (0.1, 1.0, 0.0)),
    ]
    assert found[3].pose.position == (0.0, 0.0, 0.5)


def test_groups_and_bits_tell_what_is_seen_and_touched(tmp_path: Path) -> None:
    found = shapes(
        tmp_path,
        '<geom size=".1"/><geom size=".2" group="3"/><geom size=".3" contype="0" conaffinity="0"/>'
        '<geom size=".4" group="4" contype="0" conaffinity="0"/><geom size=".5" rgba="1 0 0 0" contype="0"/>',
    )
    assert [(shape.size[0], shape.is_seen, shape.is_touched) for shape in found] == [
        (0.1, True, True),
        (0.2, False, True),
        (0.3, True, False),
        (0.5, False, True),
    ]


def test_a_robot_without_shapes_to_draw_is_drawn_by_those_for_contact(tmp_path: Path) -> None:
    assert shapes(tmp_path, '<geom size=".1" group="3"/>')[0].is_seen


def test_colour_is_the_geoms_own_else_its_materials(tmp_path: Path) -> None:
    found = shapes(
        tmp_path,
        '<geom size=".1"/><geom size=".1" material="red"/><geom size=".1" material="red" rgba="0 0.1 0 1"/>',
        '<asset><material name="red" rgba="1 0 0 1"/></asset>',
    )
    assert [shape.colour for shape in found] == [None, (1.0, 0.0, 0.0, 1.0), (0.0, 0.1, 0.0, 1.0)]


@given(
    scale=st.one_of(st.tuples(SCALES).map(lambda one: one * 3), st.tuples(SCALES, SCALES, SCALES)),
    place=st.tuples(NUMBERS, NUMBERS, NUMBERS),
    turn=st.tuples(NUMBERS, NUMBERS, NUMBERS),
    joint=st.tuples(NUMBERS, NUMBERS, NUMBERS),
)
@settings(max_examples=25)
def test_mesh_lies_where_the_engine_has_it(
    tmp_path_factory: pytest.TempPathFactory,
    scale: tuple[float, ...],
    place: tuple[float, ...],
    turn: tuple[float, ...],
    joint: tuple[float, ...],
) -> None:
    is_uniform = len(set(scale)) == 1
    places = [" ".join(map(str, numbers)) for numbers in (scale, place, turn, joint)]
    turned = f'refquat="1 {places[2]}"' if is_uniform else ""
    path = write(
        tmp_path_factory.mktemp("mesh"),
        f'<asset><mesh name="m" file="mesh.obj" scale="{places[0]}" refpos="{places[1]}" {turned}/></asset>'
        f'<worldbody><body name="base"><body name="a"><joint name="j" pos="{places[3]}"/><geom type="mesh" mesh="m" '
        f'pos="{places[2]}" euler="{places[1]}"/></body></body></worldbody>',
    )
    robot, engine = quiet(path), Moved(path, {"j": 0.7})
    (shape,) = robot.model.links["a"].shapes
    assert shape.mesh is not None
    pose = link_poses(robot.model, {"j": 0.7}, robot.world_T_root)["a"] @ shape.pose
    vertices = read_mesh(shape.mesh)[0] * shape.size @ rotation(pose).T + pose.position
    turned_back = engine.data.geom_xmat[0].reshape(3, 3)
    expected = engine.model.mesh_vert @ turned_back.T + engine.data.geom_xpos[0]
    assert len(vertices) == len(expected)
    apart = np.linalg.norm(vertices[:, None] - expected[None], axis=2)
    assert apart.min(axis=1).max() < 1e-5  # the engine's vertices have single precision
    assert apart.min(axis=0).max() < 1e-5


@pytest.mark.parametrize(
    ("geom", "asset", "why"),
    [
        (
            '<geom type="ellipsoid" size=".1 .2 .3" name="egg"/>',
            "",
            r"arm\.xml:2: geom\[egg\]: a robot has no shape of this type \(got ellipsoid\); use one of box, sphere",
        ),
        (
            '<geom type="mesh" mesh="m"/>',
            '<asset><mesh name="m" file="mesh.obj" scale="1 2 3" refquat="1 1 0 0"/></asset>',
            r"mesh 'm' has a refquat and a scale of its own for each axis; apply one of them to its file",
        ),
    ],
)
def test_shape_that_cannot_be_kept_is_refused(tmp_path: Path, geom: str, asset: str, why: str) -> None:
    with pytest.raises(DescriptionError, match=why):
        shapes(tmp_path, geom, asset)
