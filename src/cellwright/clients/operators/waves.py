"""Test signals: what a joint is asked to do, as an offset from where it stood."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from cellwright.util.errors import UsageError

LONGEST = 3600.0
"""[s]"""
FASTEST = 50.0
"""Half the rate of commands [Hz]: a faster wave cannot be said."""


class Shape(StrEnum):
    """The shape of a wave."""

    SINE = "sine"
    """To both sides of the start."""
    STEP = "step"
    """Half a period at the start, half a period away from it."""
    RAMP = "ramp"
    """Away from the start and back, at constant speed."""


@dataclass(frozen=True, slots=True)
class Wave:
    """A test signal; it lasts whole periods, so that it ends where it began.

    Attributes:
        shape: of the wave.
        amplitude: its greatest offset [rad; m]; the sign says to which side it goes first.
        frequency: periods a second [Hz].
        periods: how many.
    """

    shape: Shape
    amplitude: float
    frequency: float
    periods: int

    @classmethod
    def lasting(cls, shape: Shape, amplitude: float, frequency: float, duration: float) -> Wave:
        """A wave of about a duration [s], at least one period.

        Raises:
            UsageError: a number makes no sense.
        """
        if not math.isfinite(amplitude) or amplitude == 0.0:
            raise UsageError(f"an amplitude must be a number other than 0, not {amplitude:g}")
        if not 0.0 < frequency <= FASTEST:
            raise UsageError(f"a frequency must be above 0 and up to {FASTEST:g} Hz, not {frequency:g}")
        if not 0.0 < duration <= LONGEST:
            raise UsageError(f"a duration must be above 0 and up to {LONGEST:g} s, not {duration:g}")
        periods = max(1, round(duration * frequency))
        if periods / frequency > LONGEST:
            raise UsageError(f"a period of {1 / frequency:g} s is longer than {LONGEST:g} s")
        return cls(shape, amplitude, frequency, periods)

    @property
    def duration(self) -> float:
        """How long it lasts [s]."""
        return self.periods / self.frequency

    @property
    def reach(self) -> tuple[float, float]:
        """The lowest and the highest offset [rad; m]."""
        far = abs(self.amplitude)
        if self.shape is Shape.SINE:
            return -far, far
        return (0.0, far) if self.amplitude > 0 else (-far, 0.0)

    @property
    def speed(self) -> float:
        """The greatest speed that it asks for [rad/s; m/s]; without bound for a step."""
        match self.shape:
            case Shape.SINE:
                return abs(self.amplitude) * 2 * math.pi * self.frequency
            case Shape.RAMP:
                return abs(self.amplitude) * 2 * self.frequency
            case Shape.STEP:
                return math.inf

    def offset(self, time: float) -> float:
        """The offset [rad; m] at a time [s] from its beginning; 0 before and after."""
        if not 0.0 <= time < self.duration:
            return 0.0
        phase = time * self.frequency % 1.0
        match self.shape:
            case Shape.SINE:
                return self.amplitude * math.sin(2 * math.pi * phase)
            case Shape.RAMP:
                return self.amplitude * (1.0 - abs(2.0 * phase - 1.0))
            case Shape.STEP:
                return self.amplitude if phase >= 0.5 else 0.0
