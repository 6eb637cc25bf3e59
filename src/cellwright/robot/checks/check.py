"""Checks how a robot moves: against what was recorded of it, or else joint by joint."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction

from cellwright.config.robot.config import RobotConfig
from cellwright.robot.checks.findings import Finding, MotionReport
from cellwright.robot.checks.joints import check_joints
from cellwright.robot.checks.recorded import find_reference, read_reference
from cellwright.robot.checks.reference import compare
from cellwright.robot.checks.rig import Rig
from cellwright.robot.model.robot import TIMESTEP
from cellwright.robot.servos import Motion


def check_motion(
    config: RobotConfig,
    motion: Motion = Motion.SERVO,
    *,
    timestep: Fraction = TIMESTEP,
    self_collision: bool = False,
    tell: Callable[[Finding], None] = lambda _finding: None,
) -> MotionReport:
    """Move a robot in its node as a client would, and look at what it does.

    A robot with a recorded motion beside its configuration is compared with that. Of any other one each joint is moved
    by itself, from where the robot is put up.

    Args:
        config: the robot.
        motion: how targets are reached.
        timestep: length of a step [s]; what was recorded was so with the default one.
        self_collision: whether links may touch each other.
        tell: told each finding as it is made.

    Raises:
        UsageError: the recorded motion cannot be read.
    """
    path = find_reference(config)
    reference = None if path is None else read_reference(path)
    rig = Rig(config, motion, timestep=timestep, self_collision=self_collision)
    found: list[Finding] = []
    try:
        looks: Iterator[Finding] = check_joints(rig, config) if reference is None else compare(rig, config, reference)
        for finding in looks:
            found.append(finding)
            tell(finding)
    finally:
        rig.close()
    return MotionReport(config.name, "" if path is None else str(path), tuple(found))
