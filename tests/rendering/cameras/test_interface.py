"""Pictures as ROS messages: layout of their bytes, and points by figures."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from cellwright.rendering.camera import Pinhole
from cellwright.rendering.cameras import interface
from cellwright.rendering.cameras.picture_camera import Picture, PictureCamera

PINHOLE = Pinhole(3, 3, np.pi / 2)  # focal length 1.5 px, centre (1, 1)
COLOUR = np.arange(27, dtype=np.uint8).reshape(3, 3, 3)
DEPTH = np.full((3, 3), 2.0, np.float32)
DEPTH[0, 0] = np.nan
CAMERA = cast(
    "PictureCamera",
    SimpleNamespace(
        pinhole=PINHOLE, frame="eye", optical_frame="eye_optical", description=SimpleNamespace(has_colour=True)
    ),
)


def picture(colour: Any = COLOUR, depth: Any = DEPTH) -> Picture:
    return cast("Picture", SimpleNamespace(colour=colour, depth=depth, time_ns=1_500_000_000))


def test_images_are_rows_of_pixels_with_their_stamp() -> None:
    colour, depth = interface.colour_message(picture(), CAMERA), interface.depth_message(picture(), CAMERA)
    assert colour is not None
    assert depth is not None
    assert (colour.encoding, colour.step, bytes(colour.data)) == ("rgb8", 9, COLOUR.tobytes())
    assert (depth.encoding, depth.step, bytes(depth.data)) == ("32FC1", 12, DEPTH.tobytes())
    assert colour.header.frame_id == depth.header.frame_id == "eye_optical"
    assert (colour.header.stamp.sec, colour.header.stamp.nanosec) == (1, 500_000_000)
    assert interface.colour_message(picture(colour=None), CAMERA) is None
    assert interface.depth_message(picture(depth=None), CAMERA) is None


def test_camera_matrix_is_that_of_the_pinhole() -> None:
    info = interface.info_message(picture(), CAMERA)
    assert info.k.tolist() == pytest.approx([1.5, 0, 1, 0, 1.5, 1, 0, 0, 1])
    assert info.p.tolist() == pytest.approx([1.5, 0, 1, 0, 0, 1.5, 1, 0, 0, 0, 1, 0])
    assert not info.d.any()


def test_point_of_right_lower_pixel_is_right_below_and_has_its_colour() -> None:
    message = interface.points_message(picture(), CAMERA)
    assert message is not None
    assert (message.point_step, message.row_step) == (16, 48)
    points = np.frombuffer(bytes(message.data), np.float32).reshape(3, 3, 4)
    assert points[2, 2, :3] == pytest.approx([2 / 1.5, 2 / 1.5, 2.0])
    red, green, blue = COLOUR[2, 2].tolist()
    assert points[2, 2, 3].view(np.uint32) == red << 16 | green << 8 | blue
    assert np.isnan(points[0, 0, 2])


def test_cloud_has_measured_points_only_with_x_ahead_and_z_up() -> None:
    message = interface.cloud_message(picture(), CAMERA)
    assert message is not None
    assert (message.header.frame_id, len(message.points)) == ("eye", 8)
    last = message.points[-1]
    assert (last.x, last.y, last.z) == pytest.approx((2.0, -2 / 1.5, -2 / 1.5))
