import math

import numpy as np
import pytest

from cellwright.rendering.camera import Camera
from cellwright.rendering.gl.matrices import of_camera, of_sun

CAMERA = Camera((1, -3, 2), (0.2, 0.5, 0.7), fov=math.radians(50))
POINTS = np.random.default_rng(0).uniform(-1, 1, (50, 3))


def clip(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    found = np.column_stack([points, np.ones(len(points))]) @ matrix.T
    return np.asarray(found[:, :3] / found[:, 3:])


def test_points_appear_where_the_camera_projects_them() -> None:
    width, height = 160, 90
    found = clip(of_camera(CAMERA, width / height, 0.1, 50.0), POINTS)
    expected = CAMERA.project(POINTS, width, height)
    # rows of the picture run down, and are drawn in that order
    assert (found[:, 0] + 1) / 2 * width == pytest.approx(expected[:, 0])
    assert (found[:, 1] + 1) / 2 * height == pytest.approx(expected[:, 1])
    assert np.array_equal(np.argsort(found[:, 2]), np.argsort(expected[:, 2]))


@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.0, 1.0, 0.0)])
def test_the_sun_sees_all_within_its_reach(direction: tuple[float, float, float]) -> None:
    centre = np.array((3.0, 2.0, 1.0))
    inside = centre + POINTS / np.linalg.norm(POINTS, axis=1, keepdims=True) * 1.9
    matrix = of_sun(direction, (3.0, 2.0, 1.0), 2.0)
    found = clip(matrix, inside)
    assert (np.abs(found) <= 1).all()
    nearer = clip(matrix, inside + 0.05 * np.array(direction))
    assert (nearer[:, 2] < found[:, 2]).all()
    assert nearer[:, :2] == pytest.approx(found[:, :2])
