"""Pinhole cameras: rays through pixels, geometry of pictures, and named views of the cell.

Cameras have no distortion. Pixel coordinates are (column, row), continuous, with (0, 0) at the upper left corner of the
picture: the centre of the first pixel is (0.5, 0.5). The optical frame has x to the right, y down and z forward.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from cellwright.util.errors import UnknownNameError, UsageError
from cellwright.util.pose import Pose, Vector3

OPTICAL = Pose((0.0, 0.0, 0.0), (0.5, -0.5, 0.5, -0.5))
"""camera_T_optical: from x right, y down, z forward to x forward, y left, z up."""
_DEFAULT_ANGLE, _MAX_ANGLE = 45.0, 180.0  # [degrees]
_MAX_COORDINATE = 1e6  # [m]
_PLUMB = 1e-6  # [m] beside the vertical, a metre away from it
_UPWARDS, _AHEAD = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Camera:
    """Pinhole camera in the world frame.

    Attributes:
        eye: position of the camera [m].
        target: point in the middle of the picture [m].
        up: upward direction in the picture; need not be perpendicular to the line of sight.
        fov: vertical opening angle [rad], between 0 and pi.

    Raises:
        UsageError: the numbers make no camera.
    """

    eye: Vector3
    target: Vector3
    up: Vector3 = (0.0, 0.0, 1.0)
    fov: float = math.radians(45)

    def __post_init__(self) -> None:
        if not all(math.isfinite(v) for v in (*self.eye, *self.target, *self.up, self.fov)):
            raise UsageError("camera numbers must be finite")
        if not 0 < self.fov < math.pi:
            raise UsageError(f"camera opening angle must be between 0 and pi rad (got {self.fov:g})")
        forward = np.subtract(self.target, self.eye)
        if not np.linalg.norm(forward) > 0:
            raise UsageError("camera position and target must differ")
        across = np.cross(forward / np.linalg.norm(forward), self.up)
        if not np.linalg.norm(across) > 1e-9 * np.linalg.norm(self.up):
            raise UsageError("camera up direction must not lie along the line of sight")

    @property
    def world_R_optical(self) -> NDArray[np.float64]:
        """Rotation matrix (3, 3) from the optical frame (x right, y down, z forward) to the world frame."""
        forward = np.subtract(self.target, self.eye)
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        right = right / np.linalg.norm(right)
        return np.column_stack([right, np.cross(forward, right), forward])

    def directions(self, pixels: NDArray[np.float64], width: int, height: int) -> NDArray[np.float64]:
        """Unit vectors (n, 3), world frame, of the rays through `pixels` (n, 2) of a `width` x `height` picture."""
        slope = 2 * math.tan(self.fov / 2) / height
        optical = np.empty((len(pixels), 3))
        optical[:, 0] = (pixels[:, 0] - width / 2) * slope
        optical[:, 1] = (pixels[:, 1] - height / 2) * slope
        optical[:, 2] = 1.0
        optical /= np.sqrt(np.einsum("ij,ij->i", optical, optical))[:, None]
        # einsum, not @: for so thin a matrix the linear algebra library only wakes its threads
        world: NDArray[np.float64] = np.einsum("ij,kj->ik", optical, self.world_R_optical)
        return world


@dataclass(frozen=True)
class Pinhole:
    """Pinhole camera that looks along the +x axis of its frame, with z up.

    Here the centre of the first pixel is (0, 0), as in OpenCV and ROS, and not (0.5, 0.5) as in `Camera`.

    Its `fov` [rad] is the horizontal opening angle.
    """

    width: int
    height: int
    fov: float

    @property
    def focal_length(self) -> float:
        """Focal length in pixels, which are square."""
        return self.width / 2 / math.tan(self.fov / 2)

    @property
    def centre(self) -> tuple[float, float]:
        """Column and row of the line of sight."""
        return (self.width - 1) / 2, (self.height - 1) / 2

    @property
    def vertical_fov(self) -> float:
        """Vertical opening angle [rad]."""
        return 2 * math.atan(self.height / 2 / self.focal_length)

    def at(self, world_T_camera: Pose) -> Camera:
        """Return the camera to draw with, at a pose."""
        ahead, up = world_T_camera.transform((1.0, 0.0, 0.0)), world_T_camera.rotate((0.0, 0.0, 1.0))
        return Camera(world_T_camera.position, ahead, up, self.vertical_fov)

    @cached_property
    def slopes(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """x/z of each column, shape (width,), and y/z of each row, shape (height,), in the optical frame."""
        column, row = self.centre
        across = (np.arange(self.width) - column) / self.focal_length
        down = (np.arange(self.height) - row) / self.focal_length
        return across.astype(np.float32), down.astype(np.float32)

    def points(self, depth: NDArray[np.float32], out: NDArray[np.float32] | None = None) -> NDArray[np.float32]:
        """Return the points (height, width, 3) [m] in the optical frame for depths (height, width) [m].

        With `out`, of the same shape, the points are stored there.
        """
        across, down = self.slopes
        points = np.empty((*depth.shape, 3), np.float32) if out is None else out
        np.multiply(depth, across, out=points[..., 0])
        np.multiply(depth, down[:, None], out=points[..., 1])
        points[..., 2] = depth
        return points


VIEWS: Mapping[str, Camera] = MappingProxyType(
    {
        "overview": Camera((-4.4, -3.1, 3.3), (0.42, -0.12, 0.62), fov=math.radians(46)),
        "bins": Camera((-2.35, -0.17, 2.45), (-0.52, -0.17, 0.62), fov=math.radians(50)),
        "agv1": Camera((-1.3, 2.25, 1.9), (0.3, 3.15, 0.72), fov=math.radians(37)),
        "agv2": Camera((-1.3, -2.25, 1.9), (0.3, -3.15, 0.72), fov=math.radians(37)),
        "belt": Camera((0.3, -2.7, 2.35), (1.12, 0.9, 0.8), fov=math.radians(52)),
    }
)
"""Cameras by name, in the world frame of the cell of 2017 (conveyor along y at x = 1.21, AGVs at y = +-3.3)."""


def camera_of(text: str) -> Camera:
    """Return a camera by name, or by numbers: `x,y,z:x,y,z` for its position and its target [m].

    A third part is its vertical opening angle [degrees], as in `-4,-3,3:0,0,0.6:40`. A camera that looks straight down
    or up has the world's x axis upwards in the picture, the direction in which `overview` looks.

    Raises:
        UnknownNameError: there is no such view.
        UsageError: the numbers make no camera.
    """
    if ":" not in text:
        if text not in VIEWS:
            raise UnknownNameError("view", text, VIEWS)
        return VIEWS[text]
    eye, target, *angle = text.split(":")
    try:
        x, y, z = (float(number) for number in eye.split(","))
        at_x, at_y, at_z = (float(number) for number in target.split(","))
        (degrees,) = [float(each) for each in angle] or [_DEFAULT_ANGLE]
    except ValueError:
        raise UsageError(f"{text}: not a camera; give its position and target, such as -4,-3,3:0,0,0.6") from None
    if any(abs(number) > _MAX_COORDINATE for number in (x, y, z, at_x, at_y, at_z)):
        raise UsageError(f"{text}: coordinates must be at most {_MAX_COORDINATE:g} m")
    if not 0 < degrees < _MAX_ANGLE:
        raise UsageError(f"{text}: opening angle must be between 0 and {_MAX_ANGLE:g} degrees (got {degrees:g})")
    is_plumb = math.hypot(at_x - x, at_y - y) <= _PLUMB * abs(at_z - z)
    try:
        return Camera((x, y, z), (at_x, at_y, at_z), _AHEAD if is_plumb else _UPWARDS, math.radians(degrees))
    except UsageError as error:
        raise UsageError(f"{text}: {error}") from None
