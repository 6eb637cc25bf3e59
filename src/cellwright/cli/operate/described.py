"""The joint limits of a robot in ROS: out of the URDF that its node leaves with the master, as rviz has it."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

from cellwright.clients.operators.limits import JointLimits
from cellwright.config.robot.urdf import read_urdf
from cellwright.middleware.ros1.host.master import DEFAULT_URI, URI_VARIABLE, Master
from cellwright.util.errors import CellwrightError

PARAMETER = "robot_description"


def described_limits(environment: Mapping[str, str]) -> JointLimits:
    """The limits of the robot that is described at the master; none if there is none that can be read.

    Args:
        environment: of a program of ROS, which names the master.
    """
    try:
        text = Master(environment.get(URI_VARIABLE) or DEFAULT_URI).parameter(f"/{PARAMETER}")
        if not isinstance(text, str):
            return JointLimits()
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"{PARAMETER}.urdf"
            path.write_text(text, encoding="utf-8")
            robot = read_urdf(path, warn=_ignore)
    except CellwrightError:  # a robot can be driven without
        return JointLimits()
    return JointLimits({joint.name: joint.limits for joint in robot.driven}, PARAMETER)


def _ignore(_line: str) -> None:
    pass
