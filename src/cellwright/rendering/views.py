"""Named views of cells as cameras, and cameras from text."""

import math
from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import TypeAlias

from cellwright.config.layout.gear2017 import gear2017
from cellwright.config.layout.layout import Layout
from cellwright.config.layout.views import OVERVIEW as OVERVIEW
from cellwright.config.layout.views import views
from cellwright.rendering.camera import Camera
from cellwright.util.errors import UnknownNameError, UsageError

Viewpoint: TypeAlias = Camera | str
"""Camera, or the name of a view of the cell that is seen."""

_DEFAULT_ANGLE, _MAX_ANGLE = 45.0, 180.0  # [degrees]
_MAX_COORDINATE = 1e6  # [m]


@cache
def gear2017_views() -> Mapping[str, Camera]:
    """Return the views of the cell of 2017, and of recordings that name none."""
    return MappingProxyType(cameras(gear2017()))


def cameras(layout: Layout) -> Mapping[str, Camera]:
    """Return the views of a layout as cameras, `overview` first."""
    return {view.name: Camera.upright(view.position, view.target, view.angle) for view in views(layout)}


def viewpoint(text: str) -> Viewpoint:
    """Return a camera by numbers, `x,y,z:x,y,z` for its position and its target [m]; any other text is a view's name.

    A third part is its vertical opening angle [degrees], as in `-4,-3,3:0,0,0.6:40`.

    Raises:
        UsageError: the numbers make no camera.
    """
    if ":" not in text:
        return text
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
    try:
        return Camera.upright((x, y, z), (at_x, at_y, at_z), math.radians(degrees))
    except UsageError as error:
        raise UsageError(f"{text}: {error}") from None


def camera_of(which: Viewpoint, named: Mapping[str, Camera]) -> Camera:
    """Return the camera of a viewpoint, whose name is one of `named`.

    Raises:
        UnknownNameError: there is no such view.
    """
    if isinstance(which, Camera):
        return which
    if which not in named:
        raise UnknownNameError("view", which, named)
    return named[which]
