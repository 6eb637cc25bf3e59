"""Named views of the kit-building cell."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

from cellwright.errors import UnknownNameError
from cellwright.viewer.camera import Camera

VIEWS: Mapping[str, Camera] = MappingProxyType(
    {
        "overview": Camera((-4.6, -4.4, 3.9), (0.25, 0.0, 0.62), fov=math.radians(44)),
        "bins": Camera((-2.6, -0.17, 2.6), (-0.45, -0.17, 0.75), fov=math.radians(48)),
        "agv1": Camera((-1.1, 2.0, 1.9), (0.3, 3.15, 0.72), fov=math.radians(42)),
        "agv2": Camera((-1.1, -2.0, 1.9), (0.3, -3.15, 0.72), fov=math.radians(42)),
        "belt": Camera((-0.4, -2.6, 2.4), (1.15, 1.2, 0.9), fov=math.radians(48)),
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
