"""Triangles of each form: closed, facing outwards, of the right size."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.pose import Pose
from cellwright.scene import Form, Layer, Mesh, Scene, Shape
from cellwright.viewer.web.surfaces import Surface, joined, mesh_surface, surface

CUBE = Mesh(
    np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], np.float32),
    np.array(
        [
            *[(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)],
            *[(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)],
        ],
        np.int32,
    ),
)
FORMS = (Form.BOX, Form.CYLINDER, Form.SPHERE, Form.CAPSULE, Form.ELLIPSOID)
SIZES = st.floats(0.005, 2.0)


def of(form: Form, size: tuple[float, float, float], pose: Pose | None = None, mesh: int | None = None) -> Surface:
    shape = Shape(0, form, size, pose or Pose(), (1.0, 1.0, 1.0, 1.0), Layer.BOTH, mesh)
    return surface(shape, Scene("one", ("world",), (shape,), (CUBE,)))


def volume(found: Surface) -> float:
    a, b, c = (found.points[found.faces[:, corner]] for corner in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


def right_volume(form: Form, size: tuple[float, float, float]) -> float:
    x, y, z = size
    match form:
        case Form.BOX:
            return 8 * x * y * z
        case Form.CYLINDER:
            return math.pi * x * x * 2 * y
        case Form.SPHERE:
            return 4 / 3 * math.pi * x**3
        case Form.CAPSULE:
            return 4 / 3 * math.pi * x**3 + math.pi * x * x * 2 * y
        case _:
            return 4 / 3 * math.pi * x * y * z


@settings(max_examples=15, deadline=None)
@given(form=st.sampled_from(FORMS), size=st.tuples(SIZES, SIZES, SIZES))
def test_solids_are_closed_and_as_large_as_they_should_be(form: Form, size: tuple[float, float, float]) -> None:
    found = of(form, size)
    assert volume(found) == pytest.approx(right_volume(form, size), rel=0.12)
    edges = np.concatenate([found.faces[:, pair] for pair in ((0, 1), (1, 2), (2, 0))])
    _, places = np.unique(np.round(found.points / min(size), 5), axis=0, return_inverse=True)
    there = places.reshape(-1)[edges]
    there = there[there[:, 0] != there[:, 1]]
    forth = {(a, b) for a, b in there.tolist()}
    assert forth == {(b, a) for a, b in forth}


@settings(max_examples=15, deadline=None)
@given(form=st.sampled_from(FORMS), size=st.tuples(SIZES, SIZES, SIZES))
def test_normals_are_units_and_agree_with_the_faces(form: Form, size: tuple[float, float, float]) -> None:
    found = of(form, size)
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1.0, atol=1e-9)
    a, b, c = (found.points[found.faces[:, corner]] for corner in range(3))
    facing = np.cross(b - a, c - a)
    is_real = np.linalg.norm(facing, axis=1) > 1e-12
    for corner in range(3):
        assert ((facing * found.normals[found.faces[:, corner]]).sum(axis=1) >= -1e-9)[is_real].all()


def test_a_pose_moves_it() -> None:
    found = of(Form.BOX, (0.1, 0.2, 0.3), Pose((1.0, 2.0, 3.0), (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))))
    np.testing.assert_allclose(found.points.min(axis=0), (0.8, 1.9, 2.7), atol=1e-9)
    np.testing.assert_allclose(found.points.max(axis=0), (1.2, 2.1, 3.3), atol=1e-9)


def test_a_thin_box_keeps_its_edges() -> None:
    assert len(of(Form.BOX, (0.2, 0.2, 0.001)).points) == 24
    assert len(of(Form.BOX, (0.2, 0.2, 0.2)).points) > 24


def test_a_plane_faces_up_and_may_be_without_end() -> None:
    found = of(Form.PLANE, (0.0, 2.0, 0.1))
    np.testing.assert_allclose(found.normals, [(0.0, 0.0, 1.0)] * 4)
    assert found.points[:, 0].max() > 20
    assert found.points[:, 1].max() == 2.0


def test_a_mesh_keeps_creases_and_rounds_the_rest() -> None:
    cube = of(Form.MESH, (0.0, 0.0, 0.0), mesh=0)
    assert volume(cube) == pytest.approx(1.0)
    assert {tuple(normal) for normal in np.abs(np.round(cube.normals, 6)).tolist()} == {(1, 0, 0), (0, 1, 0), (0, 0, 1)}
    ball = of(Form.SPHERE, (0.5, 0.0, 0.0))
    round_ = mesh_surface(Mesh(ball.points.astype(np.float32), ball.faces.astype(np.int32)))
    outwards = round_.points / np.linalg.norm(round_.points, axis=1, keepdims=True)
    assert ((outwards * round_.normals).sum(axis=1) > 0.99).all()


def test_a_mesh_of_nothing_is_nothing() -> None:
    flat = Mesh(np.zeros((3, 3), np.float32), np.array([(0, 1, 2)], np.int32))
    assert len(mesh_surface(flat).faces) == 0
    assert len(joined([mesh_surface(flat), of(Form.PLANE, (1.0, 1.0, 0.1))]).faces) == 2
