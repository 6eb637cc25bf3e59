"""Frames and named places of the cell: bins, belt, AGVs, trays, the shelf; all in the world frame [m, rad].

Figures: the world template and models of the 2017 competition.
"""

import math

from cellwright.config.layout import BIN_CENTRES as BIN_CENTRES  # belongs to the frames below
from cellwright.config.layout import TRAY_FRAMES
from cellwright.util.pose import Pose

BIN_YAW = 1.5708
"""Yaw of the bins [rad], with the original's rounding."""

WORKCELL = Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, 1.57 - math.pi / 2))
"""Frame of the posts and bars: the yaw of the original's workcell is 1.57, a little less than a right angle."""

BIN_SURFACE = 0.725
"""Height [m] of the surface that parts lie on in a bin."""

TRAY_IDS: dict[str, str] = dict(zip(("agv1", "agv2"), TRAY_FRAMES, strict=True))
"""Tray id (name of the tray's link) by AGV."""

AGV_HOMES: dict[str, Pose] = {
    "agv1": Pose.from_rpy((0.3, 3.3, 0.0), (0.0, 0.0, 3.14159)),
    "agv2": Pose.from_rpy((0.3, -3.3, 0.0)),
}
"""Stations of the AGVs, where they are loaded; the yaw has the original's rounding."""

AGV_T_TRAY = Pose((0.0, 0.15, 0.75))
"""Pose of the tray in the frame of its AGV."""

TRAY_SURFACE = 0.755
"""Height [m] of the surface that parts lie on on a tray."""

CONVEYOR_CENTRE = Pose.from_rpy((1.21, 3.0, 0.8126), (0.0, 0.0, -math.pi / 2))
"""Centre of the belt's box; x points in the direction of travel."""

CONVEYOR_SIZE = (14.62206, 0.65461, 0.18862)
"""Length, width and thickness [m] of the belt's box."""

BELT_SURFACE = CONVEYOR_CENTRE.position[2] + CONVEYOR_SIZE[2] / 2
"""Height [m] of the surface that parts ride on."""

BELT_SPEED = 0.2
"""Speed of the belt at full power [m/s], towards world -y (ARIAC 2017, kMaxBeltLinVel)."""

DELETION_WALL = (1.2, -4.1, 1.41)
"""Centre of the wall at the end of the belt, which removes the parts that touch it."""

SPAWN_FRAME = Pose.from_rpy((1.21, 5.0, 0.8126), (0.0, 0.0, -1.57079))
"""Frame of the poses of belt parts; its x axis points along world -y."""

BELT_FRAME = Pose((1.24, 0.15, 0.91))
"""Frame `belt_frame` in the transform tree."""

RAIL = Pose((0.3, 0.0, 0.9))
"""Frame of the robot's rail, `linear_arm_actuator`."""

SHELF_CENTRE = (1.0, -40.0)
"""Middle x, y [m] of the shelf for parts that are not in play: outside every view, and in line with the cell.

The engine's broad phase uses boxes along the principal axes of all objects. A shelf to one side would skew these axes,
and every flat object of the cell would fill a fat box.
"""

SHELF_SURFACE = 0.5
"""Height [m] of that shelf."""

SHELF_PITCH = 0.45
"""Distance [m] between the slots of the shelf: no part, in any orientation, reaches its neighbour."""


def load_point(agv: str) -> Pose:
    """Return the frame of an AGV's load point, at the height of its tray."""
    return AGV_HOMES[agv] @ Pose((0.0, 0.0, AGV_T_TRAY.position[2]))


def shelf_slot(index: int, count: int, lower: float) -> Pose:
    """Return the shelf slot of a part; the slots form a square grid.

    Args:
        index: number of the part, from 0.
        count: number of parts on the shelf.
        lower: lowest point [m] of the part below its origin, usually 0 or negative.
    """
    columns = shelf_columns(count)
    row, column = divmod(index, columns)
    shift = (columns - 1) / 2
    return Pose(
        (
            SHELF_CENTRE[0] + SHELF_PITCH * (column - shift),
            SHELF_CENTRE[1] + SHELF_PITCH * (row - shift),
            SHELF_SURFACE - lower,
        )
    )


def shelf_columns(count: int) -> int:
    """Return the number of slots along each side of the shelf."""
    return max(1, math.ceil(math.sqrt(count)))
