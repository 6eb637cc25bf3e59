"""Named views of the kit-building cell."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

from cellwright.errors import UnknownNameError
from cellwright.rendering.camera import Camera

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
