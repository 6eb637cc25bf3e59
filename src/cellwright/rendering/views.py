"""Named views of the kit-building cell."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

from cellwright.rendering.camera import Camera
from cellwright.util.errors import UnknownNameError, UsageError

_USUAL, _WIDEST = 45.0, 180.0  # [degrees]
_FARTHEST = 1e6  # [m]
_PLUMB = 1e-6  # [m] beside the vertical, a metre away from it
_UP, _AHEAD = (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)

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


def view(name: str) -> Camera:
    """The camera of that name.

    Raises:
        UnknownNameError: if there is none.
    """
    try:
        return VIEWS[name]
    except KeyError:
        raise UnknownNameError("view", name, VIEWS) from None


def camera_of(text: str) -> Camera:
    """The camera of a name, or of numbers: `x,y,z:x,y,z` for where it stands and what it looks at [m].

    A third part is its vertical opening angle [degrees], as in `-4,-3,3:0,0,0.6:40`. What looks straight down or up has
    the x axis of the world upwards in the picture, as `overview` looks along it.

    Raises:
        UnknownNameError: there is none of that name.
        UsageError: the numbers make no camera.
    """
    if ":" not in text:
        return view(text)
    eye, target, *angle = text.split(":")
    try:
        x, y, z = (float(number) for number in eye.split(","))
        at_x, at_y, at_z = (float(number) for number in target.split(","))
        (degrees,) = [float(each) for each in angle] or [_USUAL]
    except ValueError:
        raise UsageError(f"{text}: give where it stands and what it looks at, such as -4,-3,3:0,0,0.6") from None
    if any(abs(number) > _FARTHEST for number in (x, y, z, at_x, at_y, at_z)):
        raise UsageError(f"{text}: no number may be above {_FARTHEST:g} m")
    if not 0 < degrees < _WIDEST:
        raise UsageError(f"{text}: it opens by more than 0 and less than {_WIDEST:g} degrees, not by {degrees:g}")
    is_plumb = math.hypot(at_x - x, at_y - y) <= _PLUMB * abs(at_z - z)
    up = _AHEAD if is_plumb else _UP
    try:
        return Camera((x, y, z), (at_x, at_y, at_z), up, math.radians(degrees))
    except UsageError as error:
        raise UsageError(f"{text}: {error}") from None
