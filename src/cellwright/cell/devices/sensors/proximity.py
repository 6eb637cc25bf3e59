"""The proximity sensor: the nearest thing in a narrow cone, as an ultrasonic sensor tells it."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

import numpy as np

from cellwright.cell.devices.sensors.rays import Rays, fan
from cellwright.engine.sensor import Reading, Sensor
from cellwright.engine.simulation import Simulation
from cellwright.util.pose import Pose

CONE_START = 0.023
"""Where the source of the rays is, along the +x axis of the sensor [m]."""

MIN_RANGE = 0.01
MAX_RANGE = 0.15
"""Ranges from the source [m]."""

HALF_ANGLE = 0.0625
"""Half the opening of the cone, horizontally and vertically [rad]."""

RAYS_A_SIDE = 5
RANGE_SD = 0.001
"""Standard deviation of a measured range [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ProximityReading(Reading):
    """Distance to the nearest thing in the cone [m], `MAX_RANGE` when there is nothing."""

    range: float


class ProximitySensor(Sensor[ProximityReading]):
    """A proximity sensor; it looks along the +x axis of its pose. Arguments as in `Sensor`."""

    default_period: ClassVar[Fraction] = Fraction(1, 20)

    def attach(self, simulation: Simulation) -> None:
        """Take a place in a simulation and lay the rays."""
        super().attach(simulation)
        angles = np.linspace(-HALF_ANGLE, HALF_ANGLE, RAYS_A_SIDE)
        source = self.world_T_sensor @ Pose((CONE_START, 0.0, 0.0))
        self._rays = Rays(source, fan(angles, angles), nearest=MIN_RANGE, farthest=MAX_RANGE)

    def measure(self, index: int) -> ProximityReading:
        """How near the nearest thing is now."""
        nearest = float(self._rays.cast(self.simulation).min())
        if nearest < MAX_RANGE:
            # noise on the nearest range: the least of 25 noisy ranges would be too short on average
            noisy = nearest + RANGE_SD * float(self.normal(index, 1)[0])
            nearest = max(noisy, MIN_RANGE)
        return ProximityReading(time_ns=self.simulation.now, sample=index, range=min(nearest, MAX_RANGE))
