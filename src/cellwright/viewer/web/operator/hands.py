"""Hands that are dragged: handles on a page made into poses that the tips of the arms are to go to.

Moves of a handle count from where it was taken hold of, and are added to where the tip then was: the first pose is
never far from the robot, however the handle stood. While it moves, poses are sent; when it rests for long, or is let go
of, none are, and the robot's own watchdog may hold it. Whatever ends the robot's motion ends the hold: one has to let
go, and take hold again.

`target_ee_poses` takes a pose for every arm. Arms that nobody holds keep the pose that they are being brought to, or
have; it is looked up once for each drag, so that nothing creeps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from cellwright.util.pose import Pose, normalized
from cellwright.viewer.web.operator.reach import NEAR, STRAIGHT, angle
from cellwright.viewer.web.operator.robot import Standing

PERIOD = 0.02
"""Poses are sent no more often than this [s]."""
REPEAT = 2.0
"""A handle that is held and rests is repeated for so long [s]: the way to its pose may take some time."""

_STRAYED = 1e-3  # [m; rad]


@dataclass(slots=True)
class _Hold:
    """A handle in somebody's hand.

    Attributes:
        browser: whose hand.
        handle: world_T_handle where it was taken hold of.
        tip: world_T_tip that its moves are added to.
        pose: world_T_tip that is wanted; None before it has moved.
        moved: when it moved last [s].
    """

    browser: int
    handle: Pose
    tip: Pose
    pose: Pose | None = None
    moved: float = 0.0

    def follow(self, handle: Pose) -> None:
        """Want what a handle at world_T_handle means: as far, and turned by as much, as it is now."""
        turn = Pose(quaternion=handle.quaternion) @ Pose(quaternion=self.handle.quaternion).inverse()
        turned = turn @ Pose(quaternion=self.tip.quaternion)
        x, y, z = (
            tip + now - then
            for tip, now, then in zip(self.tip.position, handle.position, self.handle.position, strict=True)
        )
        self.pose = Pose((x, y, z), normalized(turned.quaternion))


class Hands:
    """The handles of a robot's arms.

    Args:
        count: how many arms there are.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._holds: dict[int, _Hold] = {}
        self._kept: list[Pose | None] = [None] * count
        self._is_new = False
        self._sent = float("-inf")

    def grab(self, arm: int, browser: int, handle: Pose, standing: Standing) -> str:
        """A browser takes hold of a handle at world_T_handle; why it does not get it, or nothing."""
        if not 0 <= arm < self._count:
            return "there is no such arm"
        held = self._holds.get(arm)
        if held is not None and held.browser != browser:
            return "another browser holds this hand"
        if not self._holds:
            self._kept = [None] * self._count
        self._holds[arm] = _Hold(browser, handle, _now(arm, standing))
        return ""

    def move(self, arm: int, browser: int, handle: Pose, now: float) -> bool:
        """A handle was moved to world_T_handle, at `now` [s]; False when this browser does not hold it (any more)."""
        held = self._holds.get(arm)
        if held is None or held.browser != browser:
            return False
        held.follow(handle)
        held.moved = now
        self._is_new = True
        return True

    def release(self, arm: int, browser: int) -> None:
        """A browser lets go of a handle."""
        held = self._holds.get(arm)
        if held is not None and held.browser == browser:
            self._kept[arm] = None  # the others may be held on: it stays where it is being brought
            del self._holds[arm]

    def forget(self) -> bool:
        """All holds are over, also in hands that have not opened yet; whether there were any."""
        had = bool(self._holds)
        self._holds.clear()
        self._is_new = False
        return had

    def held(self, arm: int) -> Pose | None:
        """World_T_tip that is wanted of a hand whose handle is held and has been moved; None for others."""
        held = self._holds.get(arm)
        return None if held is None else held.pose

    def has_strayed(self, arm: int) -> bool:
        """Whether a handle that is held wants its hand elsewhere than where it was taken hold of."""
        held = self._holds.get(arm)
        if held is None or held.pose is None:
            return False
        return math.dist(held.pose.position, held.tip.position) > _STRAYED or angle(held.pose, held.tip) > _STRAYED

    def is_held(self, arm: int) -> bool:
        """Whether somebody has hold of a handle."""
        return arm in self._holds

    @property
    def is_any_held(self) -> bool:
        """Whether somebody has hold of any."""
        return bool(self._holds)

    def due(self, standing: Standing, now: float) -> tuple[Pose, ...] | None:
        """The poses that are to be sent now, reference_T_tip of each arm; None if none are."""
        moved = [hold for hold in self._holds.values() if hold.pose is not None]
        if not moved or now - self._sent < PERIOD:
            return None
        if not self._is_new and now - max(hold.moved for hold in moved) > REPEAT:
            return None
        self._is_new = False
        self._sent = now
        return tuple(self._target(arm, standing) for arm in range(self._count))

    def _target(self, arm: int, standing: Standing) -> Pose:
        """Reference_T_tip that an arm is to go to."""
        world_T_reference = standing.references[arm]
        wanted = self.held(arm)
        if wanted is not None:
            return world_T_reference.inverse() @ wanted
        kept = self._kept[arm]
        if kept is None:
            kept = world_T_reference.inverse() @ (standing.aims[arm] or standing.tips[arm])
            self._kept[arm] = kept
        return kept


def _now(arm: int, standing: Standing) -> Pose:
    """World_T_tip that moves of an arm's handle are added to.

    It is what the arm is being brought to if it is there but for the servos' error, so that nothing creeps; else where
    it is, so that nothing jumps.
    """
    aim, tip = standing.aims[arm], standing.tips[arm]
    is_there = aim is not None and math.dist(aim.position, tip.position) < NEAR and angle(aim, tip) < STRAIGHT
    return aim if aim is not None and is_there else tip
