"""Views of the logical cameras of a cell, and the surfaces in them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cellwright.cell.checks.surfaces import points_on
from cellwright.cell.devices.logical_camera import LogicalCamera
from cellwright.config.layout.surfaces import Surface
from cellwright.config.sensors import SensorConfig
from cellwright.config.trial.trial import Trial
from cellwright.util.pose import Pose

TYPE = "logical_camera"
_PART_HEIGHT = 0.05
"""Height of parts over a surface [m], which a camera may see where the surface itself is too far."""


def blind_cameras(trial: Trial, seen: Sequence[Surface]) -> list[tuple[SensorConfig, str]]:
    """Return the logical cameras in whose view no surface is, each with the reason."""
    points = [np.concatenate([points_on(each).reshape(-1, 3), _raised(each)]) for each in seen]
    cameras = [each for each in trial.sensors if each.type == TYPE]
    blind = [each for each in cameras if not any(_in_view(each.pose, these).any() for these in points)]
    return [(each, _reason(each.pose, seen, points)) for each in blind]


def corners(camera: Pose, depth: float) -> list[tuple[float, float, float]]:
    """Return the corners of the view of a logical camera at a depth [m], in the world, around its edge."""
    across, up = _slopes()
    signs = ((1, 1), (1, -1), (-1, -1), (-1, 1))
    return [camera.transform((depth, y * across * depth, z * up * depth)) for y, z in signs]


def looked_at(camera: Pose, seen: Sequence[Surface]) -> float:
    """Return the depth [m] at which a logical camera first sees a surface; the end of its range if it sees none."""
    depths = [
        float(local[inside, 0].min())
        for each in seen
        for local in [_local(camera, points_on(each).reshape(-1, 3))]
        for inside in [_in_cone(local) & (local[:, 0] >= LogicalCamera.near) & (local[:, 0] <= LogicalCamera.far)]
        if inside.any()
    ]
    return min(depths, default=LogicalCamera.far)


def _slopes() -> tuple[float, float]:
    across = math.tan(LogicalCamera.horizontal_fov / 2)
    return across, across / LogicalCamera.aspect


def _raised(surface: Surface) -> NDArray[np.float64]:
    return np.asarray(points_on(surface).reshape(-1, 3) + np.array([0.0, 0.0, _PART_HEIGHT]))


def _local(camera: Pose, points: NDArray[np.float64]) -> NDArray[np.float64]:
    turn = np.array([camera.rotate(axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))])
    return np.asarray((points - np.array(camera.position)) @ turn.T)


def _in_cone(local: NDArray[np.float64]) -> NDArray[np.bool_]:
    across, up = _slopes()
    x, y, z = local.T
    return np.asarray((x > 0.0) & (np.abs(y) <= across * x) & (np.abs(z) <= up * x))


def _in_view(camera: Pose, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    local = _local(camera, points)
    near, far = LogicalCamera.near, LogicalCamera.far
    return _in_cone(local) & (local[:, 0] >= near) & (local[:, 0] <= far)


def _reason(camera: Pose, seen: Sequence[Surface], points: Sequence[NDArray[np.float64]]) -> str:
    """Return why a camera sees no surface: the one in its middle is out of range, or there is none."""
    view = f"its view is from {LogicalCamera.near:g} to {LogicalCamera.far:g} m along x"
    ranges = []
    for surface, each in zip(seen, points, strict=True):
        local = _local(camera, each)
        ahead = local[_in_cone(local)]
        if ahead.size:
            aside = np.hypot(ahead[:, 1], ahead[:, 2]) / ahead[:, 0]
            nearest = int(aside.argmin())
            ranges.append((float(aside[nearest]), float(ahead[nearest, 0]), surface.name))
    if not ranges:
        return f"sees no bin, belt or tray: none is where it looks; {view}"
    _, depth, name = min(ranges)
    change = "nearer" if depth > LogicalCamera.far else "away"
    return f"sees no bin, belt or tray: {name} is {depth:.2f} m from it, and {view}; move it {change}"
