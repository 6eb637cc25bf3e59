"""The QingLong from its figures, with its two arms, and poses that they can reach."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import numpy as np

from cellwright.description.robot.config import Arm, RobotConfig
from cellwright.description.robot.posture import link_poses
from cellwright.description.robot.qinglong.figures import figures
from cellwright.pose import Pose

HOME = (0.2, -0.97, -2.0, 1.7, 0.63, 0.0, -0.43)
SIGNS = (-1, 1, -1, 1, -1, 1, -1)


@cache
def qinglong() -> RobotConfig:
    """The robot, standing at 0.9 m and turned to the left."""
    arms = tuple(
        Arm(
            tuple(f"J_arm_{side}_0{number}" for number in range(1, 8)),
            f"io_teleop_ee_link_{name}",
            HOME if side == "r" else tuple(sign * value for sign, value in zip(SIGNS, HOME, strict=True)),
        )
        for side, name in (("r", "right"), ("l", "left"))
    )
    return RobotConfig(
        robot=figures(),
        name="qinglong",
        path=Path("qinglong.yml"),
        urdf_path=Path("qinglong.urdf"),
        base_pose=Pose.from_rpy((0.0, 0.0, 0.9), (0.0, 0.0, math.pi / 2)),
        arms=arms,
        command_links=tuple(arm.tip for arm in arms),
        reference_links=("base_link", "base_link"),
    )


def tips(config: RobotConfig, positions: Mapping[str, float]) -> list[Pose]:
    """reference_T_tip of each arm in a posture [rad; m]."""
    found = link_poses(config.robot, positions)
    references = [name or config.robot.root for name in config.reference_links]
    return [
        found[reference].inverse() @ found[tip] for reference, tip in zip(references, config.command_links, strict=True)
    ]


def posture_near_home(config: RobotConfig, chance: np.random.Generator, spread: float) -> dict[str, float]:
    """Positions of the arms' joints [rad; m], up to `spread` away from home and within their limits."""
    found = {}
    for arm in config.arms:
        for name, home in zip(arm.joints, arm.home, strict=True):
            limits = config.robot.joint(name).limits
            found[name] = float(np.clip(home + chance.uniform(-spread, spread), limits.lower, limits.upper))
    return found


def apart(a: Pose, b: Pose) -> tuple[float, float]:
    """How far two poses are from each other [m, rad]."""
    difference = a.inverse() @ b
    w, x, y, z = difference.quaternion
    return math.hypot(*difference.position), 2.0 * math.atan2(math.hypot(x, y, z), abs(w))
