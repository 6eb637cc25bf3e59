"""The bundled robots, and poses that their arms can reach."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache

import numpy as np

from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import link_poses
from cellwright.config.robot.robots import load_robot
from cellwright.util.pose import Pose


@cache
def qinglong() -> RobotConfig:
    """The humanoid: seven joints an arm, its base turned to the left."""
    return load_robot("qinglong", lambda _line: None)


@cache
def tandem() -> RobotConfig:
    """The small robot: six joints an arm, both on a lift."""
    return load_robot("tandem", lambda _line: None)


def tips(config: RobotConfig, positions: Mapping[str, float]) -> list[Pose]:
    """Return reference_T_tip of each arm in a posture [rad; m]."""
    found = link_poses(config.robot, positions)
    references = [name or config.robot.root for name in config.reference_links]
    return [
        found[reference].inverse() @ found[tip] for reference, tip in zip(references, config.command_links, strict=True)
    ]


def posture_near_home(config: RobotConfig, rng: np.random.Generator, spread: float) -> dict[str, float]:
    """Return positions of the arms' joints [rad; m], up to `spread` away from home and within their limits."""
    found = {}
    for arm in config.arms:
        for name, home in zip(arm.joints, arm.home, strict=True):
            limits = config.robot.joint(name).limits
            found[name] = float(np.clip(home + rng.uniform(-spread, spread), limits.lower, limits.upper))
    return found


def apart(a: Pose, b: Pose) -> tuple[float, float]:
    """Return the distance between two poses [m, rad]."""
    difference = a.inverse() @ b
    w, x, y, z = difference.quaternion
    return math.hypot(*difference.position), 2.0 * math.atan2(math.hypot(x, y, z), abs(w))
