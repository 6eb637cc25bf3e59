"""How fast the joints may be driven."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cellwright.motion.joints import Joints
from cellwright.util.errors import UsageError


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """Largest velocity, acceleration and jerk of each joint.

    Attributes:
        velocity: [m/s for the rail; rad/s].
        acceleration: [m/s^2; rad/s^2].
        jerk: [m/s^3; rad/s^3].

    Raises:
        UsageError: one of them is not a positive finite number.
    """

    velocity: Joints
    acceleration: Joints
    jerk: Joints

    def __post_init__(self) -> None:
        for value in (*self.velocity, *self.acceleration, *self.jerk):
            if not 0.0 < value < math.inf:
                raise UsageError(f"limits of a motion must be positive and finite, not {value}")

    def slower(self, factor: float) -> MotionLimits:
        """The limits under which a motion from rest to rest takes `factor` times as long.

        Raises:
            UsageError: a factor that is not above 0 and finite.
        """
        if not 0.0 < factor < math.inf:
            raise UsageError(f"a motion cannot take {factor} times as long")
        return MotionLimits(
            Joints(*(value / factor for value in self.velocity)),
            Joints(*(value / factor**2 for value in self.acceleration)),
            Joints(*(value / factor**3 for value in self.jerk)),
        )


DEFAULT_LIMITS = MotionLimits(
    velocity=Joints(1.5, 2.0, 2.0, 2.5, 3.0, 3.0, 3.0),
    acceleration=Joints(4.0, 8.0, 8.0, 12.0, 16.0, 16.0, 16.0),
    jerk=Joints(40.0, 80.0, 80.0, 120.0, 160.0, 160.0, 160.0),
)
"""Velocities a little below the published limits (3 m/s; 2.16, 2.16, 3.15, 3.2 rad/s).

With the original's servos the rail lags with acceleration (13 mm at 4 m/s^2), the wrists with velocity. These
accelerations are those from which on a motion gains little by more."""
