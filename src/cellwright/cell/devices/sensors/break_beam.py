"""The break beam: one ray that is whole or interrupted."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

from cellwright.cell.devices.sensors.rays import Rays
from cellwright.engine.device import State
from cellwright.engine.sensor import Reading, Sensor
from cellwright.engine.simulation import Simulation
from cellwright.util.pose import Pose

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
    """A break beam; the ray runs along the +x axis of its pose. Arguments as in `Sensor`.

    It measures whoever listens: whether a reading is a change must not depend on that.
    """

    default_period: ClassVar[Fraction] = Fraction(1, 20)

    def attach(self, simulation: Simulation) -> None:
        """Take a place in a simulation and lay the ray."""
        super().attach(simulation)
        source = self.world_T_sensor @ Pose((BEAM_START, 0.0, 0.0))
        self._ray = Rays(source, [(1.0, 0.0, 0.0)], farthest=BEAM_LENGTH)
        self._detected = self._has_changed = False
        self._arm()

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

        The beam counts as whole before the first reading of a run.

        Returns:
            A function that ends it. Calling it again does nothing.
        """

        def take(reading: BeamReading) -> None:
            if self._has_changed:
                callback(reading)

        return self.listen(take)

    def reset(self) -> None:
        """Begin a run with a whole beam."""
        super().reset()
        self._detected = False

    def get_state(self) -> State:
        """The switch, and whether the newest reading found the beam interrupted."""
        return {**super().get_state(), "detected": self._detected}

    def set_state(self, state: State) -> None:
        """Go on from a saved moment."""
        super().set_state(state)
        self._detected = state["detected"]

    def _deliver(self, reading: BeamReading) -> None:
        self._has_changed = reading.detected != self._detected
        self._detected = reading.detected
        super()._deliver(reading)

    def _disarm(self) -> None:
        """Go on measuring."""

    def close(self) -> None:
        """Send all listeners away and measure no more."""
        super().close()
        super()._disarm()
