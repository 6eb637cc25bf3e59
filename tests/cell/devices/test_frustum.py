from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.devices.scene import Frustum
from cellwright.util.pose import Pose, Vector3

LOGICAL: dict[str, Any] = {"near": 0.2, "far": 0.75, "horizontal_fov": 1.1, "aspect": 1.5}
TAN_Y = math.tan(0.55)
TAN_Z = TAN_Y / 1.5

poses = st.builds(Pose.from_rpy, st.tuples(*[st.floats(-5, 5)] * 3), st.tuples(*[st.floats(-math.pi, math.pi)] * 3))
sizes = st.tuples(*[st.floats(0.001, 0.3)] * 3)


def sees(pose: Pose, point: Vector3, half: Vector3 = (0.0, 0.0, 0.0)) -> bool:
    """Return whether a box around a point in the camera's frame, along the world's axes, is in view."""
    centre = pose.transform(point)
    return bool(Frustum(pose, **LOGICAL).meets(np.array([centre]), np.array([half]))[0])


@given(poses, st.floats(0.21, 0.74), sizes, st.tuples(*[st.floats(-0.99, 0.99)] * 3))
def test_box_around_point_of_axis_is_in_view(pose: Pose, x: float, half: Vector3, shift: Vector3) -> None:
    axis_point = pose.transform((x, 0.0, 0.0))
    centre = [a + s * h for a, s, h in zip(axis_point, shift, half, strict=True)]
    assert Frustum(pose, **LOGICAL).meets(np.array([centre]), np.array([half]))[0]


@given(poses, sizes, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_box_before_near_or_behind_far_plane_is_not_in_view(pose: Pose, half: Vector3, y: float, z: float) -> None:
    radius = math.hypot(*half)
    assert not sees(pose, (0.2 - radius - 1e-6, y, z), half)
    assert not sees(pose, (0.75 + radius + 1e-6, y, z), half)


@given(poses, st.floats(0.0, 1.0), st.floats(-0.6, 0.6), st.floats(-0.6, 0.6))
def test_point_is_in_view_exactly_within_six_planes(pose: Pose, x: float, y: float, z: float) -> None:
    margin = min(x - 0.2, 0.75 - x, TAN_Y * x - abs(y), TAN_Z * x - abs(z))
    if abs(margin) > 1e-9:
        assert sees(pose, (x, y, z)) == (margin > 0)


@given(st.floats(0.0, 1.0), st.floats(-0.8, 0.8), st.floats(-0.8, 0.8), sizes)
def test_view_is_symmetric(x: float, y: float, z: float, half: Vector3) -> None:
    """The camera looks along the world's axes, so that mirrored boxes are boxes again."""
    pose = Pose()
    views = {sees(pose, (x, sy * y, sz * z), half) for sy in (1, -1) for sz in (1, -1)}
    assert len(views) == 1


@given(poses, st.floats(0.0, 1.0), st.floats(-0.6, 0.6), st.floats(-0.6, 0.6), sizes)
def test_larger_box_is_in_view_wherever_smaller_is(pose: Pose, x: float, y: float, z: float, half: Vector3) -> None:
    larger = (half[0] + 0.01, half[1] + 0.01, half[2] + 0.01)
    assert sees(pose, (x, y, z), larger) or not sees(pose, (x, y, z), half)


@pytest.mark.parametrize("touch", [0.0, 1e-9])
def test_box_that_touches_plane_is_in_view(touch: float) -> None:
    assert sees(Pose(), (0.1 + touch, 0.0, 0.0), (0.1, 0.1, 0.1))
    assert not sees(Pose(), (0.1 - 1e-9, 0.0, 0.0), (0.1, 0.1, 0.1))


def test_view_is_wider_than_high() -> None:
    assert sees(Pose(), (0.5, 0.3, 0.0))
    assert not sees(Pose(), (0.5, 0.0, 0.3))


def test_box_outside_across_edge_counts_as_in_view() -> None:
    """As in the original: no single plane has this box behind it, though no point of it is in view."""
    half = (0.3, 0.3, 0.3)
    centre = (0.75 + 0.29, 0.0, TAN_Z * 0.75 + 0.29 + 0.1)
    box = np.array([centre]), np.array([half])
    corner = (centre[0] - 0.3, 0.0, centre[2] - 0.3)  # the nearest point of the box
    assert not sees(Pose(), corner)
    assert Frustum(Pose(), **LOGICAL).meets(*box)[0]


def test_batch_of_boxes_equals_single_boxes() -> None:
    generator = np.random.default_rng(1)
    centres = generator.uniform((0.0, -0.5, -0.5), (1.0, 0.5, 0.5), (200, 3))
    halves = generator.uniform(0.01, 0.1, (200, 3))
    frustum = Frustum(Pose.from_rpy((0.1, -0.1, 0.2), (0.3, -0.2, 0.5)), **LOGICAL)
    together = frustum.meets(centres, halves)
    assert together.tolist() == [bool(frustum.meets(c[None], h[None])[0]) for c, h in zip(centres, halves, strict=True)]
    assert 10 < together.sum() < 190
