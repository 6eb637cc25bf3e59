"""Mounts of an arm: a fixed place, or a rail along which its base moves."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

from cellwright.motion.solver import Place
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose, Vector3

RAIL_STEP = 0.1
"""Largest distance [m] between neighbouring places of a rail that are tried."""


@dataclass(frozen=True, slots=True)
class FixedMount:
    """A base that does not move: on the floor, a pedestal or a table.

    Example:
        >>> [position for position, _ in FixedMount(Pose((0.0, 0.0, 0.5))).places(Pose(), 0.0)]
        [0.0]
    """

    world_T_base: Pose = field(default_factory=Pose)

    def places(self, world_T_tool: Pose, present: float) -> Iterator[Place]:  # noqa: ARG002 - of the protocol
        """Yield the one place."""
        yield Place(0.0, self.world_T_base)


@dataclass(frozen=True, slots=True)
class RailMount:
    """A rail that carries the base of an arm.

    Args:
        world_T_base: pose of the base with the rail at 0 [m].
        axis: direction of the rail in the frame of the base, a unit vector.
        lower: lowest position [m].
        upper: highest position [m].
        comfortable: horizontal distances [m] of the tool from the pan axis, the z axis of the base, at which the arm is
            neither folded up nor stretched.

    Raises:
        UsageError: the axis is no unit vector, or the range is empty or not finite.

    Example:
        >>> rail = RailMount(Pose((0.3, 0.0, 1.0)), (0.0, 1.0, 0.0), -2.1, 2.1, (0.45, 1.0))
        >>> next(rail.places(Pose((-0.3, 0.2, 0.9)), present=1.5)).position
        1.5
    """

    world_T_base: Pose
    axis: Vector3
    lower: float
    upper: float
    comfortable: tuple[float, float]

    def __post_init__(self) -> None:
        if abs(math.hypot(*self.axis) - 1.0) > 1e-6:
            raise UsageError(f"rail: the axis must be a unit vector (got {self.axis}); divide it by its length")
        if not -math.inf < self.lower <= self.upper < math.inf:
            raise UsageError(f"rail: the range must be finite and rise (got {self.lower} to {self.upper} m)")

    def places(self, world_T_tool: Pose, present: float) -> Iterator[Place]:
        """Yield places worth trying, those near the present position [m] first."""
        x, y, z = self.axis
        for position in self.positions(world_T_tool, present):
            along = Pose((position * x, position * y, position * z))
            yield Place(position, self.world_T_base @ along)

    def positions(self, world_T_tool: Pose, present: float) -> tuple[float, ...]:
        """Return positions [m] worth trying, those near the present one first.

        They are the present one, the edges of the comfortable stretches, and others every `RAIL_STEP` at most.
        """
        x, y, _ = self.world_T_base.inverse().transform(world_T_tool.position)
        ax, ay, _ = self.axis
        positions = {present}
        level = math.hypot(ax, ay)
        if level > 1e-9:
            # Seen from above, the base moves on a line, and `along` is the position from which the tool is nearest.
            along, aside = (x * ax + y * ay) / level**2, abs(x * ay - y * ax) / level
            positions.add(along)
            for radius in self.comfortable:
                if radius > aside:
                    # Positions from which the tool lies on a circle about the pan axis: two, ahead of it and behind.
                    half = math.sqrt(radius**2 - aside**2) / level
                    positions |= {along - half, along + half}
        length = self.upper - self.lower
        steps = max(1, math.ceil(length / RAIL_STEP - 1e-9))
        positions |= {self.lower + length * step / steps for step in range(steps + 1)}
        inside = {max(self.lower, min(self.upper, position)) for position in positions}
        return tuple(sorted(inside, key=lambda position: (abs(position - present), position)))
