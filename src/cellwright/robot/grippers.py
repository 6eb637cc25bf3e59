"""Grippers and hands: positions for a status from 0 (open) to 1 (closed), and the joints of each hand."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from cellwright.config.robot.config import GripperConfig, RobotConfig
from cellwright.config.robot.model import RobotModel
from cellwright.robot.servos import Array

RIGHT, LEFT = 0, 1
"""Indices of the two sides in a configuration's lists of arms and grippers."""


class GripperRange:
    """Range of a gripper's joints from open to closed: their two limits, in the configured order.

    Joints without limits, mimic joints, and joints of more than one degree of freedom, which have no number, are left
    out.
    """

    def __init__(self, gripper: GripperConfig, robot: RobotModel, numbers: Mapping[str, int]) -> None:
        joints = [robot.joint(name) for name in gripper.joints if name in numbers]
        used = [each for each in joints if not each.mimic and math.isfinite(each.limits.upper - each.limits.lower)]
        self.joints = np.array([numbers[joint.name] for joint in used], dtype=np.intp)
        ranges = [gripper.open_and_closed(joint) for joint in used]
        self._open = np.array([begin for begin, _ in ranges])
        self._span = np.array([end - begin for begin, end in ranges])

    def positions(self, status: float) -> Array:
        """Return the positions of the joints at a status from 0 to 1 [rad; m]."""
        found: Array = self._open + min(1.0, max(0.0, status)) * self._span
        return found

    def status(self, positions: Array) -> float:
        """Return how far the gripper is closed, 0 to 1, with all joints of the robot at `positions` [rad; m]."""
        total = float(np.abs(self._span).sum())
        if total <= 0.0:
            return 0.0
        closed = (positions[self.joints] - self._open) * np.sign(self._span)
        return min(1.0, max(0.0, float(closed.sum()) / total))


def gripper_ranges(
    grippers: Sequence[GripperConfig], robot: RobotModel, numbers: Mapping[str, int]
) -> tuple[GripperRange, ...]:
    """Return the ranges of all grippers, in their order."""
    return tuple(GripperRange(gripper, robot, numbers) for gripper in grippers)


def hand_joints(config: RobotConfig, side: int) -> frozenset[str] | None:
    """Return the joints of a hand by name: those of the gripper, and all below the last joint of the arm.

    None if the configuration has neither arms nor grippers, so that the hands are unknown.
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
