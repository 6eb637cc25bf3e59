"""Triangles of each form: closed, facing outwards, of the right size, at any resolution."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.rendering.scene import Mesh, Scene, SceneShape, ShapeLayer, ShapeType
from cellwright.rendering.scene.triangles import Triangles, join_triangles, mesh_triangles, shape_triangles
from cellwright.util.pose import Pose

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
SOLIDS = st.sampled_from((ShapeType.BOX, ShapeType.CYLINDER, ShapeType.SPHERE, ShapeType.CAPSULE, ShapeType.ELLIPSOID))
SIZES = st.tuples(*[st.floats(0.005, 2.0)] * 3)
CORNERS = st.sampled_from((16, 20, 48))


def of(
    form: ShapeType, size: tuple[float, float, float] = (0.0, 0.0, 0.0), pose: Pose | None = None, corners: int = 48
) -> Triangles:
    mesh = 0 if form is ShapeType.MESH else None
    shape = SceneShape(0, form, size, pose or Pose(), (1.0, 1.0, 1.0, 1.0), ShapeLayer.BOTH, mesh)
    return shape_triangles(shape, Scene("one", ("world",), (shape,), (CUBE,)), lambda _radius: corners)


def volume(found: Triangles) -> float:
    a, b, c = (found.points[found.faces[:, corner]] for corner in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


def right_volume(form: ShapeType, size: tuple[float, float, float]) -> float:
    x, y, z = size
    match form:
        case ShapeType.BOX:
            return 8 * x * y * z
        case ShapeType.CYLINDER:
            return math.pi * x * x * 2 * y
        case ShapeType.SPHERE:
            return 4 / 3 * math.pi * x**3
        case ShapeType.CAPSULE:
            return 4 / 3 * math.pi * x**3 + math.pi * x * x * 2 * y
        case _:
            return 4 / 3 * math.pi * x * y * z


@settings(max_examples=25, deadline=None)
@given(form=SOLIDS, size=SIZES, corners=CORNERS)
def test_solids_are_closed_with_right_volume(form: ShapeType, size: tuple[float, float, float], corners: int) -> None:
    found = of(form, size, corners=corners)
    assert volume(found) == pytest.approx(right_volume(form, size), rel=0.01 + 16 / corners**2)
    edges = np.concatenate([found.faces[:, pair] for pair in ((0, 1), (1, 2), (2, 0))])
    _, places = np.unique(np.round(found.points / min(size), 5), axis=0, return_inverse=True)
    there = places.reshape(-1)[edges]
    assert (there[:, 0] != there[:, 1]).all()  # no degenerate triangle
    forth = {(a, b) for a, b in there.tolist()}
    assert forth == {(b, a) for a, b in forth}


@settings(max_examples=25, deadline=None)
@given(form=SOLIDS, size=SIZES, corners=CORNERS)
def test_normals_are_units_and_agree_with_faces(
    form: ShapeType, size: tuple[float, float, float], corners: int
) -> None:
    found = of(form, size, corners=corners)
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1.0, atol=1e-9)
    a, b, c = (found.points[found.faces[:, corner]] for corner in range(3))
    facing = np.cross(b - a, c - a)
    for corner in range(3):
        assert ((facing * found.normals[found.faces[:, corner]]).sum(axis=1) >= -1e-9).all()


@given(pose=st.builds(Pose.from_rpy, SIZES, SIZES))
def test_pose_moves_triangles(pose: Pose) -> None:
    still, moved = of(ShapeType.BOX, (0.1, 0.2, 0.3)), of(ShapeType.BOX, (0.1, 0.2, 0.3), pose)
    expected = [pose.transform((x, y, z)) for x, y, z in still.points.tolist()]
    np.testing.assert_allclose(moved.points, expected, atol=1e-9)
    np.testing.assert_allclose(moved.normals[0], pose.rotate(tuple(still.normals[0].tolist())), atol=1e-9)


def test_box_edges_are_chamfered_unless_thin() -> None:
    assert len(of(ShapeType.BOX, (0.2, 0.2, 0.2)).points) > 24
    assert len(of(ShapeType.BOX, (0.2, 0.2, 0.001)).points) == 24


def test_chamfer_keeps_box_sides() -> None:
    found = of(ShapeType.BOX, (0.1, 0.2, 0.3))
    np.testing.assert_allclose(np.abs(found.points).max(axis=0), (0.1, 0.2, 0.3))
    assert not (np.abs(found.points) >= (0.1, 0.2, 0.3)).all(axis=1).any()  # no corner of the box remains


def test_plane_faces_up_and_may_be_infinite() -> None:
    found = of(ShapeType.PLANE, (0.0, 2.0, 0.1))
    np.testing.assert_allclose(found.normals, [(0.0, 0.0, 1.0)] * 4)
    assert np.ptp(found.points, axis=0).tolist() == [60.0, 4.0, 0.0]


def test_mesh_keeps_creases_and_smooths_rest() -> None:
    cube = of(ShapeType.MESH)
    assert volume(cube) == pytest.approx(1.0)
    assert {tuple(normal) for normal in np.abs(np.round(cube.normals, 6)).tolist()} == {(1, 0, 0), (0, 1, 0), (0, 0, 1)}
    ball = of(ShapeType.SPHERE, (0.5, 0.0, 0.0))
    round_ = mesh_triangles(Mesh(ball.points.astype(np.float32), ball.faces.astype(np.int32)))
    outwards = round_.points / np.linalg.norm(round_.points, axis=1, keepdims=True)
    assert ((outwards * round_.normals).sum(axis=1) > 0.99).all()


def test_degenerate_mesh_is_empty() -> None:
    flat = Mesh(np.zeros((3, 3), np.float32), np.array([(0, 1, 2)], np.int32))
    assert len(mesh_triangles(flat).faces) == 0
    assert len(join_triangles([mesh_triangles(flat), of(ShapeType.PLANE, (1.0, 1.0, 0.1))]).faces) == 2
