"""Pictures as ROS messages.

Numbers are little-endian. The optical frame has x to the right, y down and z along the line of sight. The centre of the
first pixel is (0, 0).
"""

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cellwright.middleware.messages.conversions import floats, header
from cellwright.middleware.messages.standard import (
    CameraInfo,
    Image,
    Point32,
    PointCloud,
    PointCloud2,
    PointField,
    RegionOfInterest,
)
from cellwright.rendering.cameras.picture_camera import Picture, PictureCamera

_IS_BIG = sys.byteorder == "big"
_POINT, _COLOURED = 12, 16  # bytes per point


def colour_message(picture: Picture, camera: PictureCamera) -> Image | None:
    """Return the colours; None if there are none."""
    return None if picture.colour is None else _image(picture, camera, picture.colour, "rgb8", 0)


def depth_message(picture: Picture, camera: PictureCamera) -> Image | None:
    """Return the depths [m]; None if there are none."""
    return None if picture.depth is None else _image(picture, camera, picture.depth, "32FC1", int(_IS_BIG))


def _image(picture: Picture, camera: PictureCamera, pixels: NDArray[Any], encoding: str, is_big: int) -> Image:
    height, width = pixels.shape[:2]
    stamp = header(camera.optical_frame, picture.time_ns)
    return Image(stamp, height, width, encoding, is_big, pixels.nbytes // height, _bytes(pixels))


def info_message(picture: Picture, camera: PictureCamera) -> CameraInfo:
    """Return the camera matrix of the pictures; they have no distortion."""
    pinhole = camera.pinhole
    focal, (column, row) = pinhole.focal_length, pinhole.centre
    return CameraInfo(
        header=header(camera.optical_frame, picture.time_ns),
        height=pinhole.height,
        width=pinhole.width,
        distortion_model="plumb_bob",
        d=floats(np.zeros(5)),
        k=floats([focal, 0.0, column, 0.0, focal, row, 0.0, 0.0, 1.0]),
        r=floats(np.eye(3).reshape(-1)),
        p=floats([focal, 0.0, column, 0.0, 0.0, focal, row, 0.0, 0.0, 0.0, 1.0, 0.0]),
        binning_x=0,
        binning_y=0,
        roi=RegionOfInterest(0, 0, 0, 0, do_rectify=False),
    )


def points_message(picture: Picture, camera: PictureCamera) -> PointCloud2 | None:
    """Return a point per pixel in the optical frame, with its colour if there is one; None without depth."""
    if picture.depth is None or (picture.colour is None and camera.description.has_colour):
        return None
    height, width = picture.depth.shape
    colour = picture.colour
    size = _POINT if colour is None else _COLOURED
    points = np.empty((height, width, size // 4), np.float32)
    camera.pinhole.points(picture.depth, points[..., :3])
    fields = [PointField(name, 4 * index, PointField.FLOAT32, 1) for index, name in enumerate("xyz")]
    if colour is not None:
        fields.append(PointField("rgb", _POINT, PointField.FLOAT32, 1))
        packed = colour[..., 0].astype(np.uint32)  # red, green, blue: three bytes in a float32
        for index in (1, 2):
            packed <<= 8
            packed |= colour[..., index]
        points[..., 3] = packed.view(np.float32)
    return PointCloud2(
        header=header(camera.optical_frame, picture.time_ns),
        height=height,
        width=width,
        fields=fields,
        is_bigendian=_IS_BIG,
        point_step=size,
        row_step=size * width,
        data=_bytes(points),
        is_dense=False,
    )


def cloud_message(picture: Picture, camera: PictureCamera) -> PointCloud | None:
    """Return the measured points in the camera's frame: x along the line of sight, z up; None without depth."""
    if picture.depth is None:
        return None
    points = camera.pinhole.points(picture.depth).reshape(-1, 3)
    points = points[np.isfinite(points[:, 2])]
    # the camera's axes in those of the optical frame: they need no matrix
    (forward, left, up) = (points[:, 2], -points[:, 0], -points[:, 1])
    found = [*map(Point32, forward.tolist(), left.tolist(), up.tolist())]
    return PointCloud(header(camera.frame, picture.time_ns), found, [])


def _bytes(array: NDArray[Any]) -> NDArray[np.uint8]:
    data = np.ascontiguousarray(array).reshape(-1).view(np.uint8)
    data.flags.writeable = False
    return data
