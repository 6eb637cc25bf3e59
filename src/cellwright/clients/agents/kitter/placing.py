"""Putting parts down on a tray."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass

from cellwright.clients.agents.kitter.areas import Area
from cellwright.clients.agents.kitter.arm import Arm
from cellwright.clients.agents.kitter.part_figures import PartFigures
from cellwright.clients.agents.kitter.picking import Held
from cellwright.clients.agents.kitter.postures import RAIL_END
from cellwright.clients.agents.kitter.tool_ways import at_height
from cellwright.clients.client import Client
from cellwright.util.pose import Pose

log = logging.getLogger(__name__)

SURFACE = 0.755
"""Height [m] of the tray's plate."""

DROP = 0.004
"""A part is let go this high above the plate [m]."""

NEAR = 0.012
"""So high [m] above that place the arm is corrected a last time."""


@dataclass(frozen=True, slots=True)
class Station:
    """An AGV at its load point.

    Attributes:
        number: of the AGV.
        world_T_tray: of its tray.
        rail: where the rail goes to work at it [m].
    """

    number: int
    world_T_tray: Pose
    rail: float

    @property
    def area(self) -> Area:
        """Where parts on the tray are."""
        x, y, _ = self.world_T_tray.position
        return Area((x - 0.25, y - 0.35, SURFACE - 0.02), (x + 0.25, y + 0.35, SURFACE + 0.02))


STATIONS = {
    1: Station(1, Pose.from_rpy((0.3, 3.15, 0.75), (0.0, 0.0, math.pi)), RAIL_END),
    2: Station(2, Pose.from_rpy((0.3, -3.15, 0.75)), -RAIL_END),
}
"""The AGVs by number, where the frames of the cell have them."""


class Placer:
    """Puts parts down.

    Args:
        client: whose gripper.
        arm: the arm that it is on.
    """

    def __init__(self, client: Client, arm: Arm) -> None:
        self._client = client
        self._arm = arm

    def put_down(self, held: Held, world_T_part: Pose, rail: float) -> bool:
        """Put a held part down at a pose, and draw back; False if it was lost on the way or is out of reach.

        Args:
            held: what hangs on the cup.
            world_T_part: where it is to lie; its height counts.
            rail: where the rail goes for it [m].
        """
        client, arm = self._client, self._arm
        goal = release_pose(held, world_T_part)
        z = goal.position[2]
        hover = at_height(goal, max(arm.safe, z + 0.05))
        if not arm.travel(hover, rail):
            log.info("%.1f s: %s is out of reach", client.time, world_T_part.position)
            return False
        if not client.gripper_attached:
            return False
        arm.line(at_height(goal, z + NEAR), 0.35)
        arm.settle(at_height(goal, z + NEAR))
        arm.line(goal, 0.1)
        client.sleep(0.1)
        was_held = client.gripper_attached
        client.control_gripper(False)
        client.sleep(0.1)
        arm.rise(arm.safe)
        arm.unload()
        return was_held

    def throw_away(self, held: Held) -> None:
        """Let go of a held part where it is in nobody's way: on the floor between the bins and AGV 1."""
        self._arm.travel(Pose.from_rpy((-0.15, 2.2, 1.0), (0.0, 0.0, 0.0)), 1.5)
        self._client.control_gripper(False)
        self._client.sleep(0.2)
        self._arm.unload()
        log.info("%.1f s: dropped the %s on the floor", self._client.time, held.type)


def release_pose(held: Held, world_T_part: Pose) -> Pose:
    """The gripper's pose, facing straight down, that brings a held part to a place.

    However the part hangs, its origin comes to x, y of the place and its yaw to that of the place. It hangs flat enough
    that its height can be reckoned as if it hung level.
    """
    flat = Pose.from_rpy((0.0, 0.0, 0.0), (0.0, 0.0, world_T_part.yaw - held.gripper_T_part.yaw))
    dx, dy, dz = flat.rotate(held.gripper_T_part.position)
    x, y, z = world_T_part.position
    return Pose((x - dx, y - dy, z - dz), flat.quaternion)


def pose_on_tray(station: Station, kind: PartFigures, tray_T_part: Pose, drop: float = DROP) -> Pose:
    """world_T_part of a part that is let go just above the plate, or `drop` [m] above it."""
    x, y, _ = station.world_T_tray.transform(tray_T_part.position)
    height = SURFACE + kind.below + drop
    return Pose.from_rpy((x, y, height), (0.0, 0.0, station.world_T_tray.yaw + tray_T_part.yaw))


def can_reach(arm: Arm, station: Station, held: Held, kind: PartFigures, tray_T_part: Pose) -> bool:
    """Whether the arm reaches a place on the tray with what it holds, a part of this kind."""
    goal = release_pose(held, pose_on_tray(station, kind, tray_T_part))
    return arm.reaches(goal, station.rail)
