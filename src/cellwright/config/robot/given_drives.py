"""Drives of an arm as its MJCF file gives them: its position actuators, and what resists at its joints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from cellwright.util.errors import UsageError

if TYPE_CHECKING:
    # they load the engine, which only files in MJCF need
    from cellwright.config.robot.mjcf_drives import JointDynamics, PositionDrive

_REMEDY = "use drives: stiff"


@dataclass(frozen=True, slots=True)
class GivenDrive:
    """Drive of a joint in an MJCF file: its position controller, and inertia and friction at the joint."""

    servo: PositionDrive
    dynamics: JointDynamics


def given_drives(path: Path, joints: Sequence[str]) -> dict[str, GivenDrive]:
    """Return the drives that an MJCF file gives joints, by name.

    Args:
        path: the file.
        joints: the joints that need a drive.

    Raises:
        UsageError: the file is in another format, or gives a joint none that follows positions.
        DescriptionError: the file cannot be read.
    """
    from cellwright.config.robot.mjcf import read_mjcf
    from cellwright.config.robot.mjcf_drives import JointDynamics
    from cellwright.config.robot.mjcf_file import is_mjcf

    if not is_mjcf(path):
        raise UsageError(f"only an MJCF file gives drives (got {path.name}); {_REMEDY}")
    # its warnings are those of the arm's model, which has been read
    robot = read_mjcf(path, warn=lambda _line: None)
    if lacking := [name for name in joints if name not in robot.drives]:
        raise UsageError(
            f"{path.name} has no position actuator for {', '.join(lacking)}, and a motor follows no positions; "
            f"write <position joint={lacking[0]!r} kp='…'/>, or {_REMEDY}"
        )
    for name in joints:
        lower, upper = robot.drives[name].force_range
        if lower != -upper:
            raise UsageError(
                f"the drive of {name} in {path.name} pushes from {lower:g} to {upper:g}, and a drive here pushes "
                f"alike both ways; give it a forcerange of -{upper:g} to {upper:g}, or {_REMEDY}"
            )
    return {name: GivenDrive(robot.drives[name], robot.dynamics.get(name, JointDynamics())) for name in joints}
