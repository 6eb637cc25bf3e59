"""What a node guards against beyond what it always does, as it was asked for.

Always: names that the robot does not have are passed over, messages that make no sense are refused whole, targets are
kept within the limits of the joints. All else changes how a robot behaves, and is off until it is asked for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from fnmatch import fnmatchcase

import numpy as np

from cellwright.robot.servos import Array
from cellwright.util.errors import UnknownNameError, UsageError

RESUME_SPEED = 0.5
"""How fast joints go to their first targets after they were held [rad/s; m/s]."""


class Guard(StrEnum):
    """What becomes of a first target that is too far away."""

    REFUSE = "refuse"
    """The message is refused, until one comes that is near enough."""
    BLEND = "blend"
    """The robot goes there, with the speed of resuming."""


@dataclass(frozen=True)
class SafetySettings:
    """What is guarded against.

    Attributes:
        start_disabled: take no commands until enabled by the service.
        silence: hold the joints that a topic commands when nothing has come on it for so long [s].
        max_speeds: how fast targets may move [rad/s; m/s], by patterns of joint names; the last that fits counts. A
            joint is never moved faster than its URDF says.
        start_guard: how far [rad; m] a first target may be from where the joint stands; first after the start and
            whenever the robot was held or has gone home.
        guard: what becomes of one that is farther away.
        resume_speed: how fast joints go to their first targets after they were held [rad/s; m/s].
        one_commander: take a topic's commands from one node only, until it has been silent for so long [s].
        max_age: refuse commands whose stamp is older than so long [s], and those that come out of order.
        tip_speed: how fast the tip of an arm is brought to a pose [m/s]; None: 2 m/s.
        tip_turning: how fast it is turned on the way [rad/s]; None: one turn a second.
        clutch: targets count from where they and the joint were at first, so that whoever commands need not begin
            where the robot stands.
    """

    start_disabled: bool = False
    silence: float | None = None
    max_speeds: tuple[tuple[str, float], ...] = ()
    start_guard: float | None = None
    guard: Guard = Guard.REFUSE
    resume_speed: float = RESUME_SPEED
    one_commander: float | None = None
    max_age: float | None = None
    tip_speed: float | None = None
    tip_turning: float | None = None
    clutch: bool = False

    def __post_init__(self) -> None:
        """Refuse what makes no sense.

        Raises:
            UsageError: a number that is not above 0.
        """
        named = {
            "watchdog": self.silence,
            "start guard": self.start_guard,
            "resume speed": self.resume_speed,
            "one commander": self.one_commander,
            "max age": self.max_age,
            "tip speed": self.tip_speed,
            "tip turning": self.tip_turning,
            **{f"max speed of {pattern}": speed for pattern, speed in self.max_speeds},
        }
        for name, value in named.items():
            if value is not None and not 0.0 < value < math.inf:
                raise UsageError(f"{name}: give a number above 0, not {value:g}")

    def speeds(self, joints: Sequence[str], own: Array) -> Array:
        """How fast the targets of joints may move [rad/s; m/s]; infinite where only the robot itself limits it.

        Args:
            joints: their names.
            own: what the URDF allows.

        Raises:
            UnknownNameError: a pattern that fits no joint.
        """
        found = np.full(len(joints), math.inf)
        for pattern, speed in self.max_speeds:
            fits = [fnmatchcase(joint, pattern) for joint in joints]
            if not any(fits):
                raise UnknownNameError("joint", pattern, joints)
            found[fits] = speed
        limited: Array = np.where(np.isfinite(found), np.minimum(found, own), math.inf)
        return limited
