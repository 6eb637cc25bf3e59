"""Places of the cell by name, for programs that arrange it."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from cellwright.cell.model.frames import (
    AGV_HOMES,
    AGV_T_TRAY,
    BELT_SURFACE,
    BIN_CENTRES,
    BIN_SURFACE,
    BIN_YAW,
    CONVEYOR_SIZE,
    SPAWN_FRAME,
    TRAY_SURFACE,
    load_point,
)
from cellwright.config.layout import BIN_WIDTH, TRAY_PLATE
from cellwright.util.pose import Pose, Vector3

CLEARANCE = 0.3
"""Height [m] of the space over a named pose."""


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


def named_poses(trays: Iterable[int]) -> tuple[NamedPose, ...]:
    """Return the places where parts are put: bins, begin of the belt, load points, and the given trays."""
    found = []
    for name, (x, y) in BIN_CENTRES.items():
        pose = Pose.from_rpy((x, y, BIN_SURFACE), (0.0, 0.0, BIN_YAW))
        found.append(_named(name, pose, "middle of the bin's surface", "bin", (BIN_WIDTH, BIN_WIDTH)))
    x, y, _ = SPAWN_FRAME.position
    belt = Pose((x, y, BELT_SURFACE), SPAWN_FRAME.quaternion)
    found.append(_named("belt_start", belt, "where parts appear on the belt", "belt", (CONVEYOR_SIZE[1],) * 2))
    for number in trays:
        agv = f"agv{number}"
        found.append(_named(f"{agv}_load_point", load_point(agv), "station of the AGV", "load_point", TRAY_PLATE))
        x, y, _ = (AGV_HOMES[agv] @ AGV_T_TRAY).position
        tray = Pose((x, y, TRAY_SURFACE), AGV_HOMES[agv].quaternion)
        found.append(_named(f"kit_tray_{number}", tray, "surface of the tray at its station", "tray", TRAY_PLATE))
    return tuple(found)


def _named(name: str, pose: Pose, description: str, tag: str, size: Sequence[float]) -> NamedPose:
    x, y, z = pose.position
    turned = abs(math.sin(pose.yaw)) > math.sqrt(0.5)
    width, depth = (size[1], size[0]) if turned else (size[0], size[1])
    lower, upper = (x - width / 2, y - depth / 2, z), (x + width / 2, y + depth / 2, z + CLEARANCE)
    return NamedPose(name, pose, description, (tag,), Box(lower, upper))
