"""Arrays of messages: shapes, types and refusals."""

from __future__ import annotations

from dataclasses import fields
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.messages.arrays import image_array, joint_arrays, points_array
from cellwright.middleware.messages.conversions import header, joint_state
from cellwright.middleware.messages.standard import Image, Point32, PointCloud, PointCloud2, PointField
from cellwright.util.errors import MessageError

FIELDS = [PointField(name, 4 * index, PointField.FLOAT32, 1) for index, name in enumerate("xyz")]


def vars_of(message: Any) -> dict[str, Any]:
    """Return the fields of a message, as a message of another origin has them."""
    return {each.name: getattr(message, each.name) for each in fields(message)}


def image(pixels: np.ndarray, encoding: str, *, padding: int = 0, is_big: bool = False) -> Image:
    height, width = pixels.shape[:2]
    rows = pixels.astype(pixels.dtype.newbyteorder(">" if is_big else "<")).reshape(height, -1).view(np.uint8)
    data = np.pad(rows, ((0, 0), (0, padding)), constant_values=77)
    return Image(header("", 0), height, width, encoding, int(is_big), data.shape[1], data.reshape(-1))


@given(st.integers(1, 4), st.integers(1, 5), st.sampled_from([0, 4, 8]), st.booleans())
def test_picture_has_shape_type_and_values_of_its_encoding(height: int, width: int, padding: int, is_big: bool) -> None:
    colours = np.arange(height * width * 3, dtype=np.uint8).reshape(height, width, 3)
    depths = np.linspace(0.0, 2.0, height * width, dtype=np.float32).reshape(height, width)
    for pixels, encoding in ((colours, "rgb8"), (depths, "32FC1")):
        found = image_array(image(pixels, encoding, padding=padding, is_big=is_big))
        assert (found.dtype, found.shape) == (pixels.dtype, pixels.shape)
        assert np.array_equal(found, pixels)


def test_picture_of_bytes_as_in_ros_is_read() -> None:
    message = image(np.ones((2, 3, 3), np.uint8), "rgb8")
    assert image_array(SimpleNamespace(**vars_of(message) | {"data": bytes(message.data)})).shape == (2, 3, 3)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"encoding": "yuv422"}, "encoding 'yuv422' is unknown"),
        ({"height": 3}, "do not fit 3 × 3 pixels"),
        ({"width": 4}, "do not fit 2 × 4 pixels"),
        ({"step": 8}, "in rows of 8"),
    ],
)
def test_picture_that_does_not_fit_is_refused(changes: dict[str, object], words: str) -> None:
    message = image(np.ones((2, 3, 3), np.uint8), "rgb8")
    with pytest.raises(MessageError, match=words):
        image_array(SimpleNamespace(**vars_of(message) | changes))


def test_points_have_place_of_their_pixel() -> None:
    points = np.arange(2 * 3 * 3, dtype=np.float32).reshape(2, 3, 3)
    colours = np.concatenate([points, np.zeros((2, 3, 1), np.float32)], axis=-1)
    fields = [*FIELDS, PointField("rgb", 12, PointField.FLOAT32, 1)]
    for values, names, step in ((points, FIELDS, 12), (colours, fields, 16)):
        data = values.astype("<f4").reshape(-1).view(np.uint8)
        cloud = PointCloud2(header("", 0), 2, 3, names, False, step, 3 * step, data, True)
        assert np.array_equal(points_array(cloud), points)
    assert points_array(PointCloud(header("", 0), [Point32(1.0, 2.0, 3.0)], [])).tolist() == [[1.0, 2.0, 3.0]]
    assert points_array(PointCloud(header("", 0), [], [])).shape == (0, 3)


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"fields": FIELDS[:2]}, "x, y and z"), ({"width": 4}, "do not fit"), ({"point_step": 8}, "do not fit")],
)
def test_points_that_do_not_fit_are_refused(changes: dict[str, object], words: str) -> None:
    cloud = PointCloud2(header("", 0), 1, 3, FIELDS, False, 12, 36, np.zeros(36, np.uint8), True)
    with pytest.raises(MessageError, match=words):
        points_array(SimpleNamespace(**vars_of(cloud) | changes))


def test_joint_arrays_have_names_of_their_entries() -> None:
    found = joint_arrays(joint_state(("b", "a"), [1.0, 2.0], [3.0, 4.0], [], time=1_500_000_000))
    assert found.names == ("b", "a")
    assert dict(zip(found.names, found.positions.tolist(), strict=True)) == {"b": 1.0, "a": 2.0}
    assert (found.velocities.tolist(), found.efforts.shape, found.time_ns) == ([3.0, 4.0], (0,), 1_500_000_000)
    assert found.positions.dtype == np.float64
