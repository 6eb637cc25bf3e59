"""Places of the cell by name, for programs that arrange it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from cellwright.config.trial.trial import Trial
from cellwright.util.pose import Pose, Vector3

CLEARANCE = 0.3
"""Height [m] of the space over a named pose."""
PLACE_SIZE = 0.3
"""Edges [m] of the space over a place of the layout's own."""


@dataclass(frozen=True)
class Box:
    """Box along the world's axes: lower and upper corner [m]."""

    lower: Vector3
    upper: Vector3


@dataclass(frozen=True)
class NamedPose:
    """Place of the cell by name, and the free space over it."""

    name: str
    pose: Pose
    description: str
    tags: tuple[str, ...]
    space: Box


def named_poses(trial: Trial) -> tuple[NamedPose, ...]:
    """Return the places where parts are put: bins, begins of belts, load points, trays, and the layout's own places."""
    found = []
    for each in trial.layout.bins:
        pose = Pose((*each.centre, each.surface), each.link.quaternion)
        found.append(_named(each.name, pose, "middle of the bin's surface", "bin", each.size))
    for belt in trial.layout.belts:
        x, y, _ = belt.spawn.position
        pose = Pose((x, y, belt.surface), belt.spawn.quaternion)
        found.append(_named(f"{belt.name}_start", pose, "where parts appear on the belt", "belt", (belt.size[1],) * 2))
    for agv in trial.carriers:
        point, tray = agv.load_point, agv.tray_surface
        found.append(_named(f"{agv.name}_load_point", point, "station of the AGV", "load_point", agv.plate))
        found.append(_named(agv.tray_name, tray, "surface of the tray at its station", "tray", agv.plate))
    trays = trial.layout.trays
    found += [_named(each.name, each.tray_surface, "surface of the fixed tray", "tray", each.plate) for each in trays]
    found += [
        _named(each.name, each.pose, "place of the layout", "place", (PLACE_SIZE,) * 2) for each in trial.layout.places
    ]
    return tuple(found)


def _named(name: str, pose: Pose, description: str, tag: str, size: Sequence[float]) -> NamedPose:
    x, y, z = pose.position
    turned = abs(math.sin(pose.yaw)) > math.sqrt(0.5)
    width, depth = (size[1], size[0]) if turned else (size[0], size[1])
    lower, upper = (x - width / 2, y - depth / 2, z), (x + width / 2, y + depth / 2, z + CLEARANCE)
    return NamedPose(name, pose, description, (tag,), Box(lower, upper))
