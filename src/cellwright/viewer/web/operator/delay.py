"""How late the robot is: from a hand's first move on the page to the robot's first move that is told of."""

from __future__ import annotations

from collections import deque
from math import dist
from statistics import median

from cellwright.util.pose import Pose
from cellwright.viewer.web.operator.reach import angle
from cellwright.viewer.web.operator.robot import Standing

LONGEST = 2.0
"""A robot that has not moved after so long [s] was not going to."""

_MOVED, _TURNED = 5e-4, 2e-3  # [m], [rad; m for joints]
_NEWEST = 9


class Delay:
    """Measures it at the beginning of each motion, when the robot was at rest."""

    def __init__(self) -> None:
        self._found: deque[float] = deque(maxlen=_NEWEST)
        self._begun: float | None = None
        self._tips: tuple[Pose, ...] = ()
        self._positions: tuple[float | None, ...] = ()

    @property
    def seconds(self) -> float | None:
        """The median of the newest ones [s]; None before the first."""
        return median(self._found) if self._found else None

    def begin(self, standing: Standing, now: float) -> None:
        """Somebody's hand begins to move at `now` [s]; not while another motion is still waited for."""
        if self._begun is None or now - self._begun > LONGEST:
            self._begun, self._tips, self._positions = now, standing.tips, standing.positions

    def look(self, standing: Standing, now: float) -> None:
        """This was heard of the robot at `now` [s]."""
        if self._begun is None:
            return
        if now - self._begun > LONGEST or len(standing.positions) != len(self._positions):
            self._begun = None
        elif self._has_moved(standing):
            self._found.append(now - self._begun)
            self._begun = None

    def forget(self) -> None:
        """What began is no motion of the robot's any more."""
        self._begun = None

    def _has_moved(self, standing: Standing) -> bool:
        pairs = zip(self._positions, standing.positions, strict=True)
        if any(before is not None and now is not None and abs(now - before) > _TURNED for before, now in pairs):
            return True
        tips = zip(self._tips, standing.tips, strict=True)
        return any(dist(before.position, now.position) > _MOVED or angle(before, now) > _TURNED for before, now in tips)
