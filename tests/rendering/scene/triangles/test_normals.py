import numpy as np
import pytest

from cellwright.rendering.scene.triangles import soft_normals


def roof(rise: float) -> tuple[np.ndarray, np.ndarray]:
    """Two squares that meet along y, each `rise` above the ground per length."""
    vertices = np.array([(-1, 0, -rise), (0, 0, 0), (0, 1, 0), (-1, 1, -rise), (1, 0, -rise), (1, 1, -rise)], float)
    faces = np.array([(0, 1, 2), (0, 2, 3), (1, 4, 5), (1, 5, 2)])
    return vertices, faces


def test_flat_ridge_is_smooth() -> None:
    vertices, faces = roof(0.1)
    normals = soft_normals(vertices, faces)
    on_ridge = np.abs(vertices[faces.reshape(-1), 0]) < 1e-9
    assert (normals[on_ridge, 2] > 0.998).all()
    assert normals[~on_ridge, 2] == pytest.approx(np.full((~on_ridge).sum(), 1 / np.hypot(1, 0.1)))


def test_steep_ridge_stays_sharp() -> None:
    vertices, faces = roof(1.0)
    normals = soft_normals(vertices, faces)
    assert np.abs(normals[:, 0]) == pytest.approx(np.full(12, np.sqrt(0.5)))


def test_duplicate_vertices_are_one_vertex() -> None:
    vertices, faces = roof(0.1)
    apart = vertices[faces.reshape(-1)]
    assert soft_normals(apart, np.arange(12).reshape(4, 3)) == pytest.approx(soft_normals(vertices, faces))


def test_degenerate_face_has_unit_normal() -> None:
    normals = soft_normals(np.zeros((3, 3)), np.array([(0, 1, 2)]))
    assert np.linalg.norm(normals, axis=1) == pytest.approx(np.ones(3))


def test_vertex_of_very_many_faces_has_flat_normals() -> None:
    count = 200
    angle = np.arange(count) * 2 * np.pi / count
    rim = np.column_stack([np.cos(angle), np.sin(angle), np.full(count, -0.1)])
    vertices = np.concatenate([[(0, 0, 0)], rim])
    faces = np.column_stack([np.zeros(count, int), 1 + np.arange(count), 1 + (np.arange(count) + 1) % count])
    tips = soft_normals(vertices, faces)[0::3]
    assert len(np.unique(tips.round(6), axis=0)) == count
