"""Joints that are moved by sliders: each goes to where its slider stands, at a speed that a hand can follow.

A slider can be thrown from one end to the other in an instant. The target then walks from where the joint is measured
to be, and waits for a joint that is held up. A slider that nobody touches shows where its joint is; what was set that
way is never taken for a wish.
"""

from __future__ import annotations

from dataclasses import dataclass

from cellwright.viewer.web.operator.robot import SeenRobot, Standing

SPEED = {"rad": 1.5, "m": 0.3}
"""How fast targets walk [rad/s; m/s]."""
LEAD = {"rad": 0.3, "m": 0.1}
"""How far [rad; m] a target may be ahead of its joint."""
PATIENCE = 2.0
"""A joint that does not get on for so long [s] is given up."""
AFTERWARDS = 1.0
"""So long [s] after it was moved a slider still stands where it was put."""

_STEP = 0.25  # [s]: no more than this is walked at once, however late one comes
_PROGRESS = 1e-3  # [rad; m]


@dataclass(slots=True)
class _Walk:
    """A target on its way: what is wanted, and how far it is [rad; m]."""

    wanted: float
    target: float | None = None
    stepped: float = 0.0
    nearest: float = float("inf")
    gained: float = 0.0


class JointMoves:
    """The sliders of a robot's joints.

    Args:
        robot: whose they are.
    """

    def __init__(self, robot: SeenRobot) -> None:
        self._robot = robot
        self._walks: dict[int, _Walk] = {}
        self._touched: dict[int, float] = {}
        self.note = ""
        """What became of a joint that did not get where it should, in a sentence; to be read and emptied."""

    def ask(self, joint: int, position: float, now: float) -> None:
        """Somebody wants a joint at a position [rad; m], which is cut off at its limits."""
        wanted = self._robot.clamped(joint, position)
        walk = self._walks.get(joint)
        if walk is None:
            self._walks[joint] = _Walk(wanted, stepped=now, gained=now)
        else:
            walk.wanted, walk.nearest, walk.gained = wanted, float("inf"), now
        self._touched[joint] = now

    def forget(self) -> bool:
        """No joint goes on; whether any was on its way."""
        had = bool(self._walks)
        self._walks.clear()
        self._touched.clear()
        return had

    def give_way(self, joints: tuple[int, ...]) -> None:
        """These joints are moved by something else now."""
        for joint in joints:
            self._walks.pop(joint, None)
            self._touched.pop(joint, None)

    def is_touched(self, joint: int, now: float) -> bool:
        """Whether a slider stands where somebody wants it, and is not to follow its joint."""
        return joint in self._walks or now - self._touched.get(joint, float("-inf")) < AFTERWARDS

    def due(self, standing: Standing, now: float) -> dict[int, float]:
        """Targets that are to be sent now [rad; m], by joint."""
        found = {}
        for joint, walk in list(self._walks.items()):
            measured = standing.positions[joint]
            if measured is None:
                measured = standing.targets[joint]
            target = self._step(walk, self._robot.joints[joint].unit, measured, now)
            if target is not None:
                found[joint] = target
            if walk.target == walk.wanted:
                self._end(joint, now)
            elif now - walk.gained > PATIENCE:
                self._end(joint, now)
                self.note = f"{self._robot.joints[joint].name} is held up: it stands at {measured:.3f}"
        return found

    def _step(self, walk: _Walk, unit: str, measured: float, now: float) -> float | None:
        """The next target of a walk; None if it has to wait."""
        before = measured if walk.target is None else walk.target
        reach = SPEED[unit] * min(now - walk.stepped, _STEP)
        target = before + min(max(walk.wanted - before, -reach), reach)
        target = min(max(target, measured - LEAD[unit]), measured + LEAD[unit])
        walk.stepped = now
        if (left := abs(walk.wanted - target)) < walk.nearest - _PROGRESS or left == 0.0:
            walk.nearest, walk.gained = left, now
        if target == walk.target:
            return None
        walk.target = target
        return target

    def _end(self, joint: int, now: float) -> None:
        del self._walks[joint]
        self._touched[joint] = now
