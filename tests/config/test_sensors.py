"""Sensors and cameras as values."""

import pytest

from cellwright.config.sensors import PictureCameraConfig
from cellwright.util.pose import Pose


@pytest.mark.parametrize(
    ("kind", "pictures"),
    [("rgb_camera", (True, False)), ("depth_camera", (False, True)), ("rgbd_camera", (True, True))],
)
def test_type_of_a_camera_says_what_it_measures(kind: str, pictures: tuple[bool, bool]) -> None:
    camera = PictureCameraConfig("camera", kind, Pose())
    assert (camera.has_colour, camera.has_depth) == pictures
