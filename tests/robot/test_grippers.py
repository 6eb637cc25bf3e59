"""Grippers between open and closed, at either limit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cellwright.config.robot.config import GripperConfig, RangeEnd
from cellwright.robot.checks.motion import check_motion
from cellwright.robot.grippers import GripperRange
from cellwright.robot.node import RobotNode
from cellwright.robot.servos import Array
from tests.robot.robots import two_arms

FINGERS = ("finger_right", "finger_left")  # of two hands: each is a separate joint
RANGE = (0.0, 0.04)


def make_range(*open_ends: RangeEnd) -> tuple[GripperRange, Array]:
    """Return a gripper of two joints, and an array for the positions of all joints of its robot."""
    robot = two_arms().robot
    numbers = {joint.name: number for number, joint in enumerate(robot.driven)}
    return GripperRange(GripperConfig(FINGERS, open_ends), robot, numbers), np.zeros(len(numbers))


@pytest.mark.parametrize(
    ("open_ends", "opened", "half", "closed"),
    [
        ((), [0.0, 0.0], [0.01, 0.01], [0.04, 0.04]),
        ((RangeEnd.UPPER, RangeEnd.UPPER), [0.04, 0.04], [0.03, 0.03], [0.0, 0.0]),
        ((RangeEnd.UPPER, RangeEnd.LOWER), [0.04, 0.0], [0.03, 0.01], [0.0, 0.04]),
    ],
)
def test_gripper_status_0_is_at_configured_open_limits(
    open_ends: tuple[RangeEnd, ...], opened: list[float], half: list[float], closed: list[float]
) -> None:
    gripper, positions = make_range(*open_ends)
    for status, expected in ((0.0, opened), (0.25, half), (1.0, closed), (1.5, closed)):
        positions[gripper.joints] = gripper.positions(status)
        assert positions[gripper.joints] == pytest.approx(expected)
        assert gripper.status(positions) == pytest.approx(min(status, 1.0))


def test_homing_opens_grippers() -> None:
    config = replace(two_arms(), grippers=(GripperConfig(FINGERS[:1], (RangeEnd.UPPER,)), GripperConfig(FINGERS[1:])))
    assert (config.home["finger_right"], config.home["finger_left"]) == (0.04, 0.0)
    findings = {finding.what: finding for finding in check_motion(RobotNode(config)).findings}
    assert findings["right gripper closes"].passed
    assert findings["homing time"].passed
