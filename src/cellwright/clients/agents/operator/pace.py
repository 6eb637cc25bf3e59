"""Pace of a motion that a person asks for: it begins and ends gently, however far the goal is."""

from __future__ import annotations

import math
from collections.abc import Sequence

from cellwright.motion.paths import angle_between, between
from cellwright.util.pose import Pose

TOOL_SPEED, TURN_SPEED = 0.8, 1.5
"""Greatest speed of the tool [m/s], and about any axis [rad/s]."""
JOINT_SPEED, SLIDE_SPEED = 1.5, 0.8
"""Greatest speed of a joint [rad/s], and of one that slides [m/s], unless its own is less."""
RAMP = 0.4
"""Time [s] from rest to full speed, and from full speed to rest."""


class Pace:
    """Speed of one motion, as a share of its full speed.

    Distances are in seconds at full speed, so one pace serves tools and joints. Speeds rise by 1 / `RAMP` a second, and
    a goal at distance d is approached with sqrt(2 d / `RAMP`) at most: from there the same deceleration ends at it.

    Example:
        >>> pace = Pace()
        >>> [round(pace.way(10.0, 0.1), 3) for _ in range(5)]
        [0.025, 0.05, 0.075, 0.1, 0.1]
    """

    def __init__(self) -> None:
        self.share = 0.0
        """Present speed."""

    def way(self, distance: float, period: float, most: float = 1.0) -> float:
        """Return the way of the next period [s at full speed] to a goal at a distance.

        Args:
            distance: distance to the goal [s at full speed]; infinite for a motion without one.
            period: length of the period [s].
            most: greatest speed, as a share.
        """
        self.share = min(most, self.share + period / RAMP, math.sqrt(2.0 * distance / RAMP))
        return min(distance, self.share * period)

    def stop(self) -> None:
        """Begin at rest again."""
        self.share = 0.0


def tool_distance(one: Pose, other: Pose) -> float:
    """Return the distance of two poses of a tool [s at full speed]."""
    return max(math.dist(one.position, other.position) / TOOL_SPEED, angle_between(one, other) / TURN_SPEED)


def tool_step(present: Pose, goal: Pose, pace: Pace, period: float, most: float = 1.0) -> Pose:
    """Return the pose of the tool at the end of a period on its straight way to a goal."""
    distance = tool_distance(present, goal)
    way = pace.way(distance, period, most)
    return goal if way >= distance else between(present, goal, way / distance)


def joint_step(
    present: Sequence[float], goal: Sequence[float], speeds: Sequence[float], pace: Pace, period: float
) -> list[float]:
    """Return the positions of joints at the end of a period on their straight way to a goal [rad; m]."""
    ways = [b - a for a, b in zip(present, goal, strict=True)]
    distance = max((abs(way) / speed for way, speed in zip(ways, speeds, strict=True)), default=0.0)
    share = 1.0 if distance <= 0.0 else pace.way(distance, period) / distance
    return [a + share * way for a, way in zip(present, ways, strict=True)]
