"""Meshes made in code: closed, facing outward, with the right dimensions."""

import math
from collections import Counter

import numpy as np
import pytest

from cellwright.engine.shapes import Circle, Mesh, gasket_outline, gear_outline, joined, lofted, ring

MESHES = {
    "gear": ring(gear_outline, 0.006, 0.0, 0.0119, 144),
    "gasket": ring(gasket_outline, 0.03, 0.0, 0.02, 72),
    "plain ring": ring(lambda _: 0.1, 0.05, -0.01, 0.01, 90),
    "drum": lofted([Circle(0.1, 0.0), Circle(0.1, 0.2)], 60),
    "wedge": joined([((-1, 0, 0), (-1, 0, 2), (1, 0, 2), (1, 0, 0)), ((-1, 3, 0), (-1, 3, 1), (1, 3, 1), (1, 3, 0))]),
    "leaning cone": lofted([Circle(0.038, -0.005), Circle(0.05, 0.003, 0.01), Circle(0.05, 0.015, 0.02, -0.1)], 24),
}


def volume(mesh: Mesh) -> float:
    """Return the volume by the divergence theorem: positive when the triangles face outward."""
    corners = mesh[0][mesh[1]]
    return float(np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6)


@pytest.mark.parametrize("name", MESHES)
def test_each_mesh_edge_joins_two_triangles(name: str) -> None:
    _, triangles = MESHES[name]
    edges = Counter((int(a), int(b)) for t in triangles for a, b in ((t[0], t[1]), (t[1], t[2]), (t[2], t[0])))
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)


@pytest.mark.parametrize("name", MESHES)
def test_mesh_triangles_face_outward(name: str) -> None:
    assert volume(MESHES[name]) > 0


def test_meshes_have_analytic_volume() -> None:
    assert volume(MESHES["plain ring"]) == pytest.approx(math.pi * (0.1**2 - 0.05**2) * 0.02, rel=2e-3)
    assert volume(MESHES["wedge"]) == pytest.approx(2 * 3 * 1.5)
    assert volume(MESHES["drum"]) == pytest.approx(math.pi * 0.1**2 * 0.2, rel=3e-3)


def test_gear_outline_has_18_teeth() -> None:
    radii = np.array([gear_outline(a) for a in np.linspace(0, 2 * math.pi, 3600, endpoint=False)])
    assert radii.max() == pytest.approx(0.0392)
    assert radii.min() == pytest.approx(0.0345)
    risen = (radii > 0.037) & (np.roll(radii, 1) <= 0.037)
    assert risen.sum() == 18


def test_gasket_outline_has_the_overall_size() -> None:
    angles = np.linspace(0, 2 * math.pi, 7200)
    radii = np.array([gasket_outline(a) for a in angles])
    assert np.abs(radii * np.cos(angles)).max() == pytest.approx(0.094, abs=5e-4)
    assert np.abs(radii * np.sin(angles)).max() == pytest.approx(0.043, abs=1.5e-3)
    assert radii.min() > 0.03
