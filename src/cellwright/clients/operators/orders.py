"""What an operator can want of a robot's node."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TypeAlias

from cellwright.util.pose import Pose


@dataclass(frozen=True, slots=True)
class MoveJoints:
    """Joints are to go to positions [rad; m]."""

    targets: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class MoveTips:
    """The tip of each arm is to go to a pose, base_T_tip: right, left."""

    tips: tuple[Pose, ...]


@dataclass(frozen=True, slots=True)
class MoveGrippers:
    """Each gripper is to be so far closed, 0 to 1: right, left."""

    closed: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class MoveBase:
    """The base is to move: two or three numbers, as its mode has them (see `cellwright.robot.base.Mode`)."""

    numbers: tuple[float, ...]


class Ask(Enum):
    """A service that is to be called."""

    HOME = "home"
    ENABLE = "enable"
    DISABLE = "disable"
    CLEAR_STOP = "clear the emergency stop"


class Now(Enum):
    """What comes before all else."""

    STOP = "emergency stop"
    QUIT = "quit"


Order: TypeAlias = MoveJoints | MoveTips | MoveGrippers | Ask | Now
