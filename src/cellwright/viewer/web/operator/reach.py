"""Whether a hand gets to where it is being brought."""

from __future__ import annotations

import math
from collections import deque
from enum import Enum

import numpy as np

from cellwright.util.pose import Pose

NEAR = 0.005
"""A tip so near [m] to its pose is there."""
STRAIGHT = 0.03
"""A tip turned by no more than this [rad] from its pose is there."""
RESTS = 0.4
"""So long [s] of the robot's time a tip has to rest short of its pose until that is told."""

_STILL = 0.002  # [m] and [rad] that a tip may move meanwhile


class Reach(Enum):
    """How it stands with a hand and its pose."""

    THERE = "there"
    ON_ITS_WAY = "on its way"
    SHORT = "cannot get there"


class ReachOfHand:
    """Watches a hand. One that rests while its pose is elsewhere does not get there, also where the pose moves on."""

    def __init__(self) -> None:
        self._seen: deque[tuple[int, Pose]] = deque()

    def look(self, time: int, aim: Pose | None, tip: Pose) -> Reach:
        """How it stands.

        Args:
            time: the robot's time [ns].
            aim: world_T_tip that it is being brought to; None if it is not.
            tip: world_T_tip.
        """
        seen = self._seen
        if seen and time < seen[-1][0]:
            seen.clear()
        if aim is None or (math.dist(aim.position, tip.position) < NEAR and angle(aim, tip) < STRAIGHT):
            seen.clear()
            return Reach.THERE
        seen.append((time, tip))
        while len(seen) > 1 and time - seen[1][0] >= RESTS * 1e9:
            seen.popleft()
        begun, there = seen[0]
        is_still = math.dist(there.position, tip.position) < _STILL and angle(there, tip) < _STILL
        return Reach.SHORT if time - begun >= RESTS * 1e9 and is_still else Reach.ON_ITS_WAY


def angle(one: Pose, other: Pose) -> float:
    """By how much [rad] two poses are turned against each other."""
    return 2.0 * math.acos(min(1.0, abs(float(np.dot(one.quaternion, other.quaternion)))))
