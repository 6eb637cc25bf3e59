"""The laser profiler: a flat fan of rays that draws the outline of what passes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from cellwright.cell.devices.sensors.rays import Rays, fan
from cellwright.engine.sensor import Reading, Sensor
from cellwright.engine.simulation import Simulation
from cellwright.util.pose import Pose

FAN_HEIGHT = 0.06
"""Where the source of the rays is, along the +z axis of the sensor [m]."""

HALF_ANGLE = 0.251
"""Half the opening of the fan, about the z axis of the sensor [rad]."""

RAY_COUNT = 400
ANGLE_STEP = 2 * HALF_ANGLE / (RAY_COUNT - 1)
"""Angle between two neighbouring rays [rad]."""

MIN_RANGE = 0.181
MAX_RANGE = 0.725
"""Ranges from the source [m]."""

RANGE_SD = 0.001
"""Standard deviation of a measured range [m]."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProfileReading(Reading):
    """One outline.

    Attributes:
        ranges: distance along each ray from the source [m], shape (400,), from -0.251 rad to 0.251 rad; `inf` where
            a ray meets nothing. The array cannot be written to.
    """

    ranges: NDArray[np.float64]


class LaserProfiler(Sensor[ProfileReading]):
    """A laser profiler; its fan lies about +x in the x-y plane of its pose. Arguments as in `Sensor`."""

    default_period: ClassVar[Fraction] = Fraction(1, 100)

    def attach(self, simulation: Simulation) -> None:
        """Take a place in a simulation and lay the rays."""
        super().attach(simulation)
        angles = np.linspace(-HALF_ANGLE, HALF_ANGLE, RAY_COUNT)
        source = self.world_T_sensor @ Pose((0.0, 0.0, FAN_HEIGHT))
        self._rays = Rays(source, fan(angles, np.zeros(1)), nearest=MIN_RANGE, farthest=MAX_RANGE)

    def measure(self, index: int) -> ProfileReading:
        """The outline now."""
        ranges = self._rays.cast(self.simulation)
        hits = ranges < math.inf
        if hits.any():
            noisy = ranges + RANGE_SD * self.normal(index, RAY_COUNT)
            ranges = np.where(hits, np.minimum(np.maximum(noisy, MIN_RANGE), MAX_RANGE), math.inf)
        ranges.flags.writeable = False
        return ProfileReading(time_ns=self.simulation.now, sample=index, ranges=ranges)
