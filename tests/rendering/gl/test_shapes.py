import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.pose import Pose
from cellwright.rendering.gl.shapes import Triangles, triangles
from cellwright.scene import Form, Layer, Mesh, Scene, Shape

A, B, C = 0.3, 0.2, 0.5
VOLUMES = {
    Form.SPHERE: 4 / 3 * math.pi * A**3,
    Form.CAPSULE: 4 / 3 * math.pi * A**3 + math.pi * A**2 * 2 * B,
    Form.ELLIPSOID: 4 / 3 * math.pi * A * B * C,
    Form.CYLINDER: math.pi * A**2 * 2 * B,
    Form.BOX: 8 * A * B * C,
}
TETRAHEDRON = Mesh(
    np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], np.float32),
    np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)], np.int32),
)


def surface(form: Form, size: tuple[float, float, float] = (A, B, C), pose: Pose | None = None) -> Triangles:
    mesh = 0 if form is Form.MESH else None
    shape = Shape(0, form, size, pose or Pose((0, 0, 0), (1, 0, 0, 0)), (1, 1, 1, 1), Layer.BOTH, mesh)
    return triangles(shape, Scene("", ("world",), (shape,), (TETRAHEDRON,)))


def volume(found: Triangles) -> float:
    a, b, c = (found.points[found.faces[:, corner]] for corner in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize(("form", "expected"), [*VOLUMES.items()], ids=str)
def test_forms_enclose_what_they_should(form: Form, expected: float) -> None:
    assert volume(surface(form)) == pytest.approx(expected, rel=0.03)


def test_a_mesh_keeps_its_triangles() -> None:
    assert volume(surface(Form.MESH)) == pytest.approx(1 / 6)


@pytest.mark.parametrize("form", Form, ids=str)
def test_normals_point_outward_as_the_faces_do(form: Form) -> None:
    found = surface(form)
    a, b, c = (found.points[found.faces[:, corner]] for corner in range(3))
    flat = np.cross(b - a, c - a)
    assert np.linalg.norm(found.normals, axis=1) == pytest.approx(np.ones(len(found.normals)))
    for corner in range(3):
        assert (np.einsum("ij,ij->i", flat, found.normals[found.faces[:, corner]]) >= -1e-12).all()


def test_a_plane_without_end_reaches_beyond_the_haze() -> None:
    assert np.ptp(surface(Form.PLANE, (0, 0, 1)).points, axis=0).tolist() == [120, 120, 0]
    assert np.ptp(surface(Form.PLANE, (2, 3, 1)).points, axis=0).tolist() == [4, 6, 0]


@given(st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: math.hypot(*q) > 0.1))
def test_a_shape_stands_where_its_pose_says(quaternion: tuple[float, float, float, float]) -> None:
    unit = tuple((np.array(quaternion) / np.linalg.norm(quaternion)).tolist())
    pose = Pose((1, 2, 3), unit)
    still, turned = surface(Form.BOX), surface(Form.BOX, pose=pose)
    expected = [pose @ Pose(tuple(point), (1, 0, 0, 0)) for point in still.points.tolist()]
    assert turned.points == pytest.approx(np.array([each.position for each in expected]))
