"""Taking hold of parts, at rest in a bin or on the running belt."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass

from cellwright.clients.agents.kitter.arm import FACE, Arm
from cellwright.clients.agents.kitter.belt_watch import SPEED, BeltPart
from cellwright.clients.agents.kitter.part_figures import Catalogue, PartFigures
from cellwright.clients.agents.kitter.postures import SHOULDER_OFFSET
from cellwright.clients.agents.kitter.tool_ways import FOLLOW_LEAD, FOLLOW_TIME, at_height
from cellwright.clients.client import Client
from cellwright.util.pose import Pose

log = logging.getLogger(__name__)

NEAR = 0.010
"""The cup comes this near [m] to a part at full speed."""
PRESS = 0.006
"""It is sent this far [m] into the part, slowly; it stops when the part hangs on it."""
SLOW = 0.03
"""[m/s]"""
BELT_HOVER = 0.08
"""How high [m] above its grip the cup waits for a part on the belt."""
MARGIN = 0.5
"""The arm is there so long [s] before the part."""
PATIENCE = 0.35
"""How long [s] the cup waits on the part."""


@dataclass(frozen=True, slots=True)
class Held:
    """A part on the cup: its type, where it hangs, and whether its yaw is known."""

    type: str
    gripper_T_part: Pose
    has_yaw: bool = True


def bin_rail(y: float) -> float:
    """Where the rail goes for a place among the bins at world y [m]: the arm then points straight at it."""
    return y + SHOULDER_OFFSET


def belt_rail(y: float) -> float:
    """Where the rail goes for a part that is met on the belt at world y [m]: it is followed for 0.3 m from there."""
    return y - SHOULDER_OFFSET - 0.15


class Picker:
    """Takes hold of parts.

    Args:
        client: whose gripper.
        arm: the arm that it is on.
        catalogue: the part types that can be handled.
    """

    def __init__(self, client: Client, arm: Arm, catalogue: Catalogue) -> None:
        self._client = client
        self._arm = arm
        self._catalogue = catalogue

    def from_rest(self, part_type: str, world_T_part: Pose, rail: float, *, attempt: int = 0) -> Held | None:
        """Take a part that lies still, and lift it; None if the cup got no hold of it.

        Args:
            part_type: its type.
            world_T_part: where it lies, upright.
            rail: where the rail goes for it [m].
            attempt: how often it was tried before; each time the cup goes to a slightly different place.
        """
        client, arm = self._client, self._arm
        hover, z = self._hover(part_type, world_T_part, attempt)
        if not arm.travel(hover, rail):
            return None
        client.control_gripper(True)
        arm.line(at_height(hover, z + NEAR), 0.35)
        arm.line(at_height(hover, z - PRESS), SLOW, wait=False)
        client.wait_until(lambda: client.gripper_attached, (NEAR + PRESS) / SLOW + 0.15 + PATIENCE)
        held = Held(part_type, arm.tool.inverse() @ world_T_part) if client.gripper_attached else None
        if held is not None:
            arm.load(self._catalogue.figures(part_type).height)
        arm.rise(max(arm.safe, z + 0.15))
        if held is not None and client.gripper_attached:
            return held
        client.control_gripper(False)
        arm.unload()
        return None

    def is_in_reach(self, part_type: str, world_T_part: Pose, rail: float) -> bool:
        """Whether the arm gets to a part that lies still; arguments as for `from_rest`."""
        return self._arm.reaches(self._hover(part_type, world_T_part, 0)[0], rail)

    def _hover(self, part_type: str, world_T_part: Pose, attempt: int) -> tuple[Pose, float]:
        """The gripper's pose above a part that lies still, and its height [m] with the cup's face on the part."""
        above = grip_pose(self._catalogue.figures(part_type), world_T_part, attempt, self._arm.tool.yaw)
        x, y, z = above.position
        return Pose((x, y, max(z + 0.1, 0.9)), above.quaternion), z

    def meeting_place(self, part: BeltPart, first: float, last: float) -> float | None:
        """World y [m] at which a part on the belt can be met; None if the arm comes too late.

        Args:
            part: the part.
            first: the part is met no further upstream than here.
            last: nor further downstream.
        """
        y = min(first, part.pose(self._client.time).position[1])
        for _ in range(4):
            arrival = self._client.time + self._arm.travel_time(self.belt_hover(part, y), belt_rail(y)) + MARGIN
            if not math.isfinite(arrival):
                return None
            y = min(first, part.pose(arrival).position[1])
            if y < last:
                return None
        return y

    def belt_hover(self, part: BeltPart, y: float) -> Pose:
        """Where the gripper waits for a part on the belt."""
        kind = self._catalogue.figures(part.type)
        above = grip_pose(kind, part.pose(part.time_at(y)), 0, self._arm.tool.yaw)
        return at_height(above, above.position[2] + BELT_HOVER)

    def from_belt(self, part: BeltPart, y: float) -> Held | None:
        """Take a part from the running belt about where it passes world y, and lift it; None if that failed."""
        client, arm = self._client, self._arm
        hover = self.belt_hover(part, y)
        z = hover.position[2] - BELT_HOVER
        if not arm.travel(hover, belt_rail(y)):
            return None
        meet = part.time_at(y)
        if client.time > meet - 0.05:
            log.info("%.1f s: too late for it by %.2f s", client.time, client.time - meet)
            return None
        client.doze(max(0.0, meet - FOLLOW_LEAD - client.time))
        client.control_gripper(True)
        arm.follow(hover, z + NEAR / 2, z - PRESS, SPEED)
        client.wait_until(lambda: client.gripper_attached, FOLLOW_TIME)
        held = None
        if client.gripper_attached:
            held = Held(part.type, arm.tool.inverse() @ part.pose(arm.tool_time), part.has_yaw)
            arm.load(self._catalogue.figures(part.type).height)
        arm.rise(z + 0.12)
        if held is not None and client.gripper_attached:
            return held
        client.control_gripper(False)
        arm.unload()
        return None


def grip_pose(kind: PartFigures, world_T_part: Pose, attempt: int, yaw: float) -> Pose:
    """The gripper's pose with the cup's face on the part, facing down.

    Args:
        kind: the figures of the part's type.
        world_T_part: where it is.
        attempt: 0 for the place that is best; others are a few millimetres beside it.
        yaw: how the gripper is turned [rad]; the cup is round, so it does not matter.
    """
    aside = ((0.0, 0.0), (0.006, 0.0), (-0.006, 0.0), (0.0, 0.006), (0.0, -0.006))[attempt % 5]
    x, y, _ = world_T_part.transform((kind.grip[0] + aside[0], kind.grip[1] + aside[1], 0.0))
    return Pose.from_rpy((x, y, world_T_part.position[2] + kind.top + FACE), (0.0, 0.0, yaw))
