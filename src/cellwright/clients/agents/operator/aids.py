"""Aids of an operator: a tool that points straight down, the part below it, and the belt below it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.operator.tool_arms import OperatedArm
from cellwright.config.layout.arm_models import FACE_DEPTH
from cellwright.config.layout.layout import Belt
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose, Vector3, normalized, quaternion_product

SNAP_RADIUS = 0.2
"""Distance from the tool's axis [m] within which a part is below it."""
SNAP_DEPTH = 1.0
"""Distance below the tool [m] within which a part is below it."""
HOVER = 0.03
"""Distance over a part [m] at which the tool gets over its middle before it goes down."""
PRESS = 0.004
"""Distance [m] by which a cup is pressed onto a part."""
SLOW = 0.1
"""Share of the full speed at which a tool goes down onto a part."""
BELT_HEIGHT = 0.6
"""Height over a belt [m] up to which a tool meets its speed."""

_OVER = 0.003
"""Distance from the middle of a part [m] from which the tool goes down."""
_LEAD_SHARE = 0.1
_MAX_LEAD = 0.08
"""Largest distance [m] by which the tool is commanded ahead of a part that moves."""


class SeenPart(NamedTuple):
    """A part in the cell: its name, its type, its pose, and its linear velocity in the world [m/s]."""

    name: str
    type: str
    world_T_part: Pose
    velocity: Vector3


class Surroundings(Protocol):
    """Parts and belts of a cell, now. A person sees them on the page; no sensor is asked."""

    def parts(self) -> Sequence[SeenPart]:
        """Return all parts in the cell."""
        ...

    def belts(self) -> Mapping[str, Vector3]:
        """Return the present velocity of each belt's surface in the world [m/s], by the belt's name."""
        ...


def outward_down(pose: Pose, outward: Vector3) -> Pose:
    """Return a pose of a tool that points straight down, by the smallest turn; `outward` is out of it, in its frame.

    Example:
        >>> tilted = Pose.from_rpy((0.0, 0.0, 1.0), (0.3, 0.0, 0.5))
        >>> [abs(round(each, 6)) for each in outward_down(tilted, (0.0, 0.0, -1.0)).rpy]
        [0.0, 0.0, 0.5]
    """
    x, y, z = pose.rotate(outward)
    # the turn from (x, y, z) to (0, 0, -1): its axis is their cross product, and w is 1 + their dot product
    turn = normalized((1.0 - z, -y, x, 0.0)) if z < 1.0 - 1e-9 else (0.0, 1.0, 0.0, 0.0)
    return Pose(pose.position, normalized(quaternion_product(turn, pose.quaternion)))


class PartSnap:
    """Way of a tool to the part below it: over its middle, then down onto it; with a part that moves, it moves too.

    Args:
        arm: the arm.
        name: name of the part.
        surroundings: the parts, with their present poses.
        catalogue: places on top of each type for the cup.
        has_part: returns whether the arm holds something.

    Attributes:
        name: name of the part.
    """

    def __init__(
        self,
        arm: OperatedArm,
        name: str,
        surroundings: Surroundings,
        catalogue: Catalogue,
        has_part: Callable[[], bool],
    ) -> None:
        self.name = name
        self._arm, self._surroundings, self._catalogue, self._has_part = arm, surroundings, catalogue, has_part
        self._lead = (0.0, 0.0, 0.0)
        self._is_down = False

    def goal(self, commanded: Pose, measured: Pose) -> tuple[Pose, float] | None:
        """Return the pose for the tool now, and the greatest speed; None if the part is held, or gone."""
        part = next((each for each in self._surroundings.parts() if each.name == self.name), None)
        if part is None or self._has_part():
            return None
        # Where a part moves, soft servos stay behind by their delay: the tool is commanded as far ahead.
        if math.hypot(*part.velocity) > 1e-3:
            behind = (a - b for a, b in zip(commanded.position, measured.position, strict=True))
            lead = [old + _LEAD_SHARE * (new - old) for old, new in zip(self._lead, behind, strict=True)]
            x, y, _ = (max(-_MAX_LEAD, min(_MAX_LEAD, each)) for each in lead)
            self._lead = (x, y, 0.0)
        spot = _spot(part, self._catalogue)
        top = (spot[0] + self._lead[0], spot[1] + self._lead[1], spot[2])
        tool = _tool_on(self._arm, commanded, top)
        beside = math.dist(measured.position[:2], _tool_on(self._arm, commanded, spot).position[:2])
        self._is_down |= beside < _OVER and measured.position[2] < tool.position[2] + 2 * HOVER
        if self._is_down and _holds_by_cup(self._arm):
            return _raised(tool, -PRESS), SLOW
        if self._is_down and not any(part.velocity):
            return None  # fingers close by hand
        return _raised(tool, HOVER), 1.0


def snap_below(
    arm: OperatedArm,
    world_T_tool: Pose,
    surroundings: Surroundings | None,
    catalogue: Catalogue,
    has_part: Callable[[], bool],
) -> PartSnap:
    """Return the way to the part below a tool, the nearest to its axis.

    Raises:
        UsageError: no part that the tool can grip is below it, the arm holds one, or parts are not known here.
    """
    if surroundings is None:
        raise UsageError("snap: parts are known in the process of the cell alone; run it with --operator")
    if arm.arm is None or arm.arm.tool.kind == "none" or not arm.has_place:
        raise UsageError(f"snap: {arm.name} has no suction cup or gripper whose place is known; move its tool")
    if has_part():
        raise UsageError(f"snap: {arm.name} holds a part; release it first")
    x, y, z = world_T_tool.position

    def aside(part: SeenPart) -> float:
        px, py, _ = _spot(part, catalogue)
        return math.hypot(px - x, py - y)

    near = [
        part
        for part in surroundings.parts()
        if math.dist(part.world_T_part.position[:2], (x, y)) < SNAP_RADIUS
        and -SNAP_DEPTH < part.world_T_part.position[2] - z < 0.0
    ]
    known = [part for part in near if part.type in catalogue]
    if not known:
        reasons = [f"; {part.name}: {catalogue.why_not(part.type)}" for part in near[:1]]
        raise UsageError(f"snap: no part within {SNAP_RADIUS:g} m below the tool{''.join(reasons)}; move over one")
    return PartSnap(arm, min(known, key=aside).name, surroundings, catalogue, has_part)


@dataclass(frozen=True)
class BeltAid:
    """Speed of the belt below a tool.

    Attributes:
        belts: the belts of the layout.
        surroundings: their present speeds; without them, each runs at full speed.
    """

    belts: Sequence[Belt]
    surroundings: Surroundings | None

    def velocity(self, world_T_tool: Pose) -> Vector3:
        """Return the velocity of the belt below a tool [m/s]; zero where there is none."""
        x, y, z = world_T_tool.position
        for belt in self.belts:
            if belt.covers(x, y) and 0.0 < z - belt.surface < BELT_HEIGHT:
                if self.surroundings is not None:
                    return self.surroundings.belts()[belt.name]
                dx, dy, dz = belt.direction
                return (dx * belt.speed, dy * belt.speed, dz * belt.speed)
        return (0.0, 0.0, 0.0)


def _spot(part: SeenPart, catalogue: Catalogue) -> Vector3:
    """Return the place on top of a part where it is gripped, in the world [m]."""
    figures = catalogue.figures(part.type)
    pose, _ = catalogue.side_up(part.type, part.world_T_part)
    return pose.transform((*figures.grip, figures.top))


def _tool_on(arm: OperatedArm, present: Pose, top: Vector3) -> Pose:
    """Return the pose of a tool that touches a place with its face, pointing down, turned about as at present."""
    assert arm.arm is not None
    assert arm.outward is not None
    tool = arm.arm.tool
    length = FACE_DEPTH if tool.kind == "vacuum" else tool.length
    return outward_down(Pose((top[0], top[1], top[2] + length), present.quaternion), arm.outward)


def _holds_by_cup(arm: OperatedArm) -> bool:
    return arm.arm is not None and arm.arm.tool.kind == "vacuum"


def _raised(pose: Pose, by: float) -> Pose:
    x, y, z = pose.position
    return Pose((x, y, z + by), pose.quaternion)
