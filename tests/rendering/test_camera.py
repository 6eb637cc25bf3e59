import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from cellwright.rendering.camera import Camera
from cellwright.util.errors import UsageError
from cellwright.util.pose import Vector3
from tests.rendering.scenes import project

coordinates = st.floats(-10, 10)
points = st.tuples(coordinates, coordinates, coordinates)


@st.composite
def cameras(draw: st.DrawFn) -> Camera:
    eye, target = np.array(draw(points)), np.array(draw(points))
    forward = target - eye
    assume(np.linalg.norm(forward) > 1e-3)
    assume(np.linalg.norm(forward[:2]) > 1e-3 * np.linalg.norm(forward))
    return Camera(tuple(eye), tuple(target), fov=draw(st.floats(0.1, 2.5)))


@given(cameras())
def test_optical_frame_is_rotation(camera: Camera) -> None:
    world_R_optical = camera.world_R_optical
    assert np.allclose(world_R_optical.T @ world_R_optical, np.eye(3), atol=1e-9)
    assert np.linalg.det(world_R_optical) == pytest.approx(1)
    assert world_R_optical[2, 1] <= 0, "down in the picture is down in the world"
    assert world_R_optical[2, 0] == pytest.approx(0, abs=1e-9), "the horizon is level"


@given(cameras(), st.integers(1, 2000), st.integers(1, 2000), st.data())
def test_point_on_pixel_ray_projects_to_pixel(camera: Camera, width: int, height: int, data: st.DataObject) -> None:
    pixel = np.array([[data.draw(st.floats(0, width)), data.draw(st.floats(0, height))]])
    direction = camera.directions(pixel, width, height)
    assert np.linalg.norm(direction) == pytest.approx(1)
    assume((direction @ camera.world_R_optical)[0, 2] > 1e-3)
    far = data.draw(st.floats(0.1, 100))
    projected = project(camera, np.array(camera.eye) + far * direction, width, height)
    assert np.allclose(projected[0, :2], pixel[0], atol=1e-4)
    assert 0 < projected[0, 2] <= far * (1 + 1e-9)


@pytest.mark.slow
@given(cameras(), st.integers(1, 500), st.integers(1, 500))
def test_target_is_in_middle_of_picture(camera: Camera, width: int, height: int) -> None:
    projected = project(camera, np.array([camera.target]), width, height)[0]
    assert projected[:2] == pytest.approx((width / 2, height / 2), abs=1e-4)
    assert projected[2] == pytest.approx(math.dist(camera.eye, camera.target))


@pytest.mark.slow
@given(cameras())
def test_opening_angle_spans_picture_height(camera: Camera) -> None:
    top, bottom = camera.directions(np.array([[8.0, 0.0], [8.0, 9.0]]), 16, 9)
    assert math.acos(np.clip(top @ bottom, -1, 1)) == pytest.approx(camera.fov, abs=1e-6)


def test_picture_axes_point_right_and_up() -> None:
    camera = Camera((0, -5, 1), (0, 0, 1))
    right, up, behind = project(camera, np.array([(1.0, 0, 1), (0, 0, 2.0), (0, -6.0, 1)]), 100, 100)
    assert right[0] > 50
    assert right[1] == pytest.approx(50)
    assert up[1] < 50
    assert behind[2] == pytest.approx(-1)
    assert np.isnan(behind[:2]).all()


@pytest.mark.parametrize(
    ("eye", "target", "up", "fov"),
    [
        ((0.0, 0.0, 1.0), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0), 1.0),
        ((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0),
        ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0),
        ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.0),
        ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), math.pi),
        ((0.0, 0.0, math.nan), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0),
        ((0.0, 0.0, 1.0), (math.inf, 0.0, 0.0), (0.0, 0.0, 1.0), 1.0),
    ],
)
def test_invalid_camera_is_refused(eye: Vector3, target: Vector3, up: Vector3, fov: float) -> None:
    with pytest.raises(UsageError):
        Camera(eye, target, up, fov)
