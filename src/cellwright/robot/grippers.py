"""Grippers and hands: positions for a status from 0 (open) to 1 (closed), and the joints of each hand."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from cellwright.config.robot.config import Gripper, RobotConfig
from cellwright.config.robot.model import RobotModel
from cellwright.robot.servos import Array


class GripperRange:
    """A gripper's joints between open and closed: the two limits of each, as the configuration has them.

    Joints without limits, those that follow another, and those of more than one degree of freedom, which have no
    number, have no part in it.
    """

    def __init__(self, gripper: Gripper, robot: RobotModel, numbers: Mapping[str, int]) -> None:
        joints = [robot.joint(name) for name in gripper.joints if name in numbers]
        used = [each for each in joints if not each.mimic and math.isfinite(each.limits.upper - each.limits.lower)]
        self.joints = np.array([numbers[joint.name] for joint in used], dtype=np.intp)
        ways = [gripper.way(joint) for joint in used]
        self._open = np.array([begin for begin, _ in ways])
        self._way = np.array([end - begin for begin, end in ways])

    def positions(self, status: float) -> Array:
        """Where the joints are to be for a status from 0 to 1 [rad; m]."""
        found: Array = self._open + min(1.0, max(0.0, status)) * self._way
        return found

    def status(self, positions: Array) -> float:
        """How far the gripper is closed, 0 to 1, with all joints of the robot at `positions` [rad; m]."""
        whole = float(np.abs(self._way).sum())
        if whole <= 0.0:
            return 0.0
        closed = (positions[self.joints] - self._open) * np.sign(self._way)
        return min(1.0, max(0.0, float(closed.sum()) / whole))


def gripper_ranges(
    grippers: Sequence[Gripper], robot: RobotModel, numbers: Mapping[str, int]
) -> tuple[GripperRange, ...]:
    """Of all grippers, in their order."""
    return tuple(GripperRange(gripper, robot, numbers) for gripper in grippers)


RIGHT, LEFT = 0, 1
"""Places of the two sides in a configuration's lists of arms and grippers."""


def hand_joints(config: RobotConfig, side: int) -> frozenset[str] | None:
    """The joints of a hand, by name: those of the gripper, and all that hang below the last joint of the arm.

    None where the configuration has neither arms nor grippers, so that nothing is known of hands.
    """
    if not config.arms and not config.grippers:
        return None
    found: set[str] = set()
    if side < len(config.grippers):
        found.update(config.grippers[side].joints)
    if side < len(config.arms) and config.arms[side].joints:
        robot, wrist = config.robot, config.arms[side].joints[-1]
        arm = set(config.arms[side].joints)
        found.update(
            joint.name
            for joint in robot.driven
            if joint.name not in arm and any(above.name == wrist for above in robot.chain(joint.child))
        )
    return frozenset(found)
