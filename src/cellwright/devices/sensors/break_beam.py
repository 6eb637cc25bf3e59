"""The break beam: one ray that is whole or interrupted."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

from cellwright.devices.sensors.rays import Rays
from cellwright.devices.sensors.sensor import Reading, Sensor
from cellwright.pose import Pose
from cellwright.simulation.simulation import Simulation

BEAM_START = 0.025
"""Where the ray begins, along the +x axis of the sensor [m]."""

BEAM_LENGTH = 1.0
"""[m]"""

RANGE_SD = 0.001
"""Standard deviation of a measured range [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BeamReading(Reading):
    """Whether the beam is interrupted.

    Attributes:
        detected: whether something stands in the beam.
        range: distance to it from the beginning of the ray [m], `inf` when the beam is whole.
    """

    detected: bool
    range: float


class BreakBeam(Sensor[BeamReading]):
    """A break beam; the ray runs along the +x axis of its pose. Arguments as in `Sensor`."""

    default_period: ClassVar[Fraction] = Fraction(1, 20)

    def attach(self, simulation: Simulation) -> None:
        """Take a place in a simulation and lay the ray."""
        super().attach(simulation)
        source = self.world_T_sensor @ Pose((BEAM_START, 0.0, 0.0))
        self._ray = Rays(source, [(1.0, 0.0, 0.0)], farthest=BEAM_LENGTH)

    def measure(self, index: int) -> BeamReading:
        """Whether the beam is interrupted now."""
        found = float(self._ray.cast(self.simulation)[0])
        if math.isfinite(found):
            noisy = found + RANGE_SD * float(self.normal(index, 1)[0])
            found = min(max(noisy, 0.0), BEAM_LENGTH)
        # at either end of the ray the beam counts as whole, as it did in the original cell
        detected = 0.0 < found < BEAM_LENGTH
        return BeamReading(
            time_ns=self.simulation.now, sample=index, detected=detected, range=found if detected else math.inf
        )

    def listen_changes(self, callback: Callable[[BeamReading], None]) -> Callable[[], None]:
        """Have those readings given to `callback` that differ from the one before in `detected`.

        The beam counts as whole before the first reading, so that this one is a change only if it is interrupted.

        Returns:
            A function that ends it. Calling it again does nothing.
        """
        return self.listen(_Changes(callback))


class _Changes:
    """Passes on the changes in what one listener sees, independent of all other listeners."""

    def __init__(self, callback: Callable[[BeamReading], None]) -> None:
        self._callback = callback
        self._time = -1
        self._detected = False

    def __call__(self, reading: BeamReading) -> None:
        before = self._detected if reading.time_ns > self._time else False  # time jumped back: another run
        self._time = reading.time_ns
        self._detected = reading.detected
        if reading.detected != before:
            self._callback(reading)
