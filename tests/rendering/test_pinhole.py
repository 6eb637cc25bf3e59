"""Geometry of pictures: matrix, rays and points agree with the camera that draws."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.rendering.camera import OPTICAL, Pinhole
from cellwright.util.pose import Pose
from tests.rendering.scenes import project

PINHOLES = st.builds(Pinhole, st.integers(8, 60), st.integers(8, 60), st.floats(0.1, 2.5))
POSES = st.builds(Pose.from_rpy, st.tuples(*[st.floats(-3.0, 3.0)] * 3), st.tuples(*[st.floats(-3.0, 3.0)] * 3))


def test_pinhole_of_right_angle_has_known_focal_length() -> None:
    pinhole = Pinhole(640, 480, math.pi / 2)
    assert pinhole.focal_length == pytest.approx(320.0)
    assert pinhole.centre == (319.5, 239.5)
    assert pinhole.vertical_fov == pytest.approx(2 * math.atan(0.75))


def test_optical_frame_axes_in_camera_frame() -> None:
    for optical, camera in (((1, 0, 0), (0, -1, 0)), ((0, 1, 0), (0, 0, -1)), ((0, 0, 1), (1, 0, 0))):
        assert OPTICAL.rotate(optical) == pytest.approx(camera)


@given(pinhole=PINHOLES, pose=POSES, share=st.tuples(st.floats(0, 1), st.floats(0, 1)), depth=st.floats(0.1, 9))
def test_point_of_depth_projects_to_its_pixel(
    pinhole: Pinhole, pose: Pose, share: tuple[float, float], depth: float
) -> None:
    column, row = int(share[0] * (pinhole.width - 1)), int(share[1] * (pinhole.height - 1))
    points = pinhole.points(np.full((pinhole.height, pinhole.width), depth, np.float32))
    x, y, z = points[row, column].astype(float).tolist()
    world = (pose @ OPTICAL).transform((x, y, z))
    seen = project(pinhole.at(pose), np.array([world]), pinhole.width, pinhole.height)[0]
    assert seen == pytest.approx([column + 0.5, row + 0.5, depth], abs=1e-3)


@given(pinhole=PINHOLES, pose=POSES)
def test_drawing_camera_has_field_of_view_of_pinhole(pinhole: Pinhole, pose: Pose) -> None:
    camera = pinhole.at(pose)
    edges = np.array([[0.0, pinhole.height / 2], [pinhole.width, pinhole.height / 2]])
    left, right = camera.directions(edges, pinhole.width, pinhole.height)
    assert math.acos(float(left @ right)) == pytest.approx(pinhole.fov, abs=1e-6)
    assert camera.world_R_optical[:, 2] == pytest.approx(pose.rotate((1.0, 0.0, 0.0)), abs=1e-9)
    assert camera.world_R_optical[:, 1] == pytest.approx(pose.rotate((0.0, 0.0, -1.0)), abs=1e-9)


def test_missing_depth_gives_no_point() -> None:
    pinhole = Pinhole(8, 8, 1.0)
    depth = np.full((8, 8), np.nan, np.float32)
    depth[3, 4] = 1.0
    assert np.isfinite(pinhole.points(depth)).all(axis=2).sum() == 1
