"""Range sensors: rays from one point, and the break beam, proximity sensor and laser profiler that cast them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.engine.sensor import Reading, Sensor
from cellwright.engine.simulation import Simulation, State
from cellwright.util.pose import Pose, Vector3

SOLID_GROUPS = (1, 3)
"""Geom groups that stop a ray: what is solid. What is only drawn, such as a sensor's own housing, is in group 2."""

_SOLID_GROUP_MASK = np.array([group in SOLID_GROUPS for group in range(mujoco.mjNGROUP)], dtype=np.uint8)

_MARGIN = 1e-6
"""Added to the radius of the ball around a geom [m]: rounding must not make a ray miss what the engine has it meet."""

_AXES: tuple[Vector3, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

_SHOWN_RAYS = 8
"""Viewers are shown one of so many rays of a profile."""

_FAR_AWAY = 1e9
"""Coordinate of what is to be out of reach of every ray [m]."""


def ray_fan(horizontal: NDArray[np.float64], vertical: NDArray[np.float64]) -> list[Vector3]:
    """Unit directions about +x, one for each pair of angles [rad]; horizontal angles run fastest.

    A horizontal angle turns towards +y, a vertical one towards +z.
    """
    return [
        (math.cos(v) * math.cos(h), math.cos(v) * math.sin(h), math.sin(v))
        for v in vertical.tolist()
        for h in horizontal.tolist()
    ]


class Rays:
    """A bundle of rays that start `nearest` away from one point and end `farthest` away from it.

    What lies nearer than `nearest` does not stop a ray: it begins behind it. A ray that begins within a solid meets
    the solid's far side.

    Args:
        world_T_source: the point, and the frame of the directions.
        directions: unit vectors.
        nearest: distance at which the rays begin [m].
        farthest: distance at which they end [m].
    """

    def __init__(
        self, world_T_source: Pose, directions: list[Vector3], *, nearest: float = 0.0, farthest: float
    ) -> None:
        self.nearest = nearest
        self.farthest = farthest
        self.count = len(directions)
        self._source = np.array(world_T_source.position)
        self._directions = np.array([world_T_source.rotate(direction) for direction in directions])
        self._axes = np.array([world_T_source.rotate(axis) for axis in _AXES])
        ends = farthest * np.array([[0.0, 0.0, 0.0], *directions]).T
        low, high = ends.min(axis=1, keepdims=True), ends.max(axis=1, keepdims=True)
        self._middle, self._half = self._axes @ self._source[:, None] + (low + high) / 2, (high - low) / 2
        self._model: mujoco.MjModel | None = None
        self._movable: NDArray[np.intp] = np.empty(0, dtype=np.intp)
        self._radii, self._reaches = np.empty(0), np.empty((3, 0))
        self._fixed = np.empty(0)

    def cast(self, simulation: Simulation) -> NDArray[np.float64]:
        """How far each ray goes, measured from the source [m], shape (count,); `inf` where nothing stops it.

        Positions must be up to date (`Simulation.refresh`). What never moves is looked at once; after that a ray is
        cast only if something that can move is near it.
        """
        if simulation.model is not self._model:
            self._look_at_fixed(simulation)
        distances = self._fixed.copy()
        near = self._near(simulation)
        if near.size:
            found = self._ask_engine(simulation.model, simulation.data, self._directions[near], with_fixed=False)
            distances[near] = np.minimum(distances[near], found)
        if self.nearest > 0.0:
            for ray in np.flatnonzero(distances < self.nearest):
                distances[ray] = self._beyond_nearest(simulation, self._directions[ray])
        return distances

    def _near(self, simulation: Simulation) -> NDArray[np.intp]:
        """Numbers of the rays that pass through a ball around something that can move, in ascending order."""
        places = simulation.data.geom_xpos.take(self._movable, axis=0)
        # first, and mostly last: what is near the box around all rays, along the axes of the source
        is_within = np.abs(self._axes @ places.T - self._middle) <= self._reaches
        within: NDArray[np.intp] = is_within.all(axis=0).nonzero()[0]
        if not within.size:
            return within
        offsets, radii = places[within] - self._source, self._radii[within]
        # what lies behind the source is as far from a ray as from the source
        along = np.maximum(self._directions @ offsets.T, 0.0)
        meets = np.einsum("gi,gi->g", offsets, offsets) - along**2 <= radii**2
        return np.flatnonzero(meets.any(axis=1))

    def _look_at_fixed(self, simulation: Simulation) -> None:
        """Learn what can move, and how far each ray goes where nothing does."""
        model = simulation.model
        moves = model.body_weldid[model.geom_bodyid] != 0
        self._movable = np.flatnonzero(moves & np.isin(model.geom_group, SOLID_GROUPS))
        self._radii = model.geom_rbound[self._movable] + _MARGIN
        self._reaches = self._half + self._radii
        self._model = model
        alone = mujoco.MjData(model)
        mujoco.mj_kinematics(model, alone)
        alone.geom_xpos[self._movable] = _FAR_AWAY
        self._fixed = self._ask_engine(model, alone, self._directions)

    def _ask_engine(
        self, model: mujoco.MjModel, data: mujoco.MjData, directions: NDArray[np.float64], *, with_fixed: bool = True
    ) -> NDArray[np.float64]:
        """How far rays go from the source before they end [m], shape (count,); `inf` where nothing stops them."""
        count = len(directions)
        found = np.empty(count)
        mujoco.mj_multiRay(
            model,
            data,
            self._source,
            directions.ravel(),
            _SOLID_GROUP_MASK,
            with_fixed,
            -1,  # no body left out
            np.empty(count, dtype=np.int32),  # which geom: nobody asks
            found,
            None,
            count,
            self.farthest,
        )
        return np.where((found >= 0.0) & (found <= self.farthest), found, math.inf)

    def _beyond_nearest(self, simulation: Simulation, direction: NDArray[np.float64]) -> float:
        """The distance of one ray that something would stop before it begins [m]."""
        start = self._source + self.nearest * direction
        found = mujoco.mj_ray(simulation.model, simulation.data, start, direction, _SOLID_GROUP_MASK, True, -1, None)
        distance = self.nearest + float(found)
        return distance if found >= 0.0 and distance <= self.farthest else math.inf


def _shown(length: float) -> float | None:
    return round(float(length), 4) if math.isfinite(length) else None


RANGE_SD = 0.001
"""Standard deviation of a measured range [m]."""

BEAM_START = 0.025
"""Where the ray begins, along the +x axis of the sensor [m]."""

BEAM_LENGTH = 1.0
"""[m]"""


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

    def describe(self) -> dict[str, Any]:
        """What viewers draw of it: a ray."""
        return super().describe() | {"form": "beam", "near": BEAM_START, "far": BEAM_LENGTH}

    def overlay(self) -> dict[str, Any]:
        """What viewers draw of a reading now."""
        reading = self.read()
        return {"sees": reading.detected, "ranges": [_shown(reading.range)]}

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


CONE_START = 0.023
"""Where the source of the rays is, along the +x axis of the sensor [m]."""

PROXIMITY_MIN_RANGE = 0.01
PROXIMITY_MAX_RANGE = 0.15
"""Ranges from the source [m]."""

CONE_HALF_ANGLE = 0.0625
"""Half the opening of the cone, horizontally and vertically [rad]."""

RAYS_A_SIDE = 5


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
        angles = np.linspace(-CONE_HALF_ANGLE, CONE_HALF_ANGLE, RAYS_A_SIDE)
        source = self.world_T_sensor @ Pose((CONE_START, 0.0, 0.0))
        self._rays = Rays(source, ray_fan(angles, angles), nearest=PROXIMITY_MIN_RANGE, farthest=PROXIMITY_MAX_RANGE)

    def measure(self, index: int) -> ProximityReading:
        """How near the nearest thing is now."""
        nearest = float(self._rays.cast(self.simulation).min())
        if nearest < PROXIMITY_MAX_RANGE:
            # noise on the nearest range: the least of 25 noisy ranges would be too short on average
            noisy = nearest + RANGE_SD * float(self.normal(index, 1)[0])
            nearest = max(noisy, PROXIMITY_MIN_RANGE)
        return ProximityReading(time_ns=self.simulation.now, sample=index, range=min(nearest, PROXIMITY_MAX_RANGE))

    def describe(self) -> dict[str, Any]:
        """What viewers draw of it: a cone."""
        figures = {"near": CONE_START, "far": PROXIMITY_MAX_RANGE, "angle": CONE_HALF_ANGLE}
        return super().describe() | {"form": "cone"} | figures

    def overlay(self) -> dict[str, Any]:
        """What viewers draw of a reading now."""
        found = self.read().range
        return {"sees": found < PROXIMITY_MAX_RANGE, "ranges": [_shown(found)]}


FAN_HEIGHT = 0.06
"""Where the source of the rays is, along the +z axis of the sensor [m]."""

FAN_HALF_ANGLE = 0.251
"""Half the opening of the fan, about the z axis of the sensor [rad]."""

FAN_RAY_COUNT = 400
FAN_ANGLE_STEP = 2 * FAN_HALF_ANGLE / (FAN_RAY_COUNT - 1)
"""Angle between two neighbouring rays [rad]."""

PROFILER_MIN_RANGE = 0.181
PROFILER_MAX_RANGE = 0.725
"""Ranges from the source [m]."""


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
        angles = np.linspace(-FAN_HALF_ANGLE, FAN_HALF_ANGLE, FAN_RAY_COUNT)
        source = self.world_T_sensor @ Pose((0.0, 0.0, FAN_HEIGHT))
        self._rays = Rays(source, ray_fan(angles, np.zeros(1)), nearest=PROFILER_MIN_RANGE, farthest=PROFILER_MAX_RANGE)

    def measure(self, index: int) -> ProfileReading:
        """The outline now."""
        ranges = self._rays.cast(self.simulation)
        hits = ranges < math.inf
        if hits.any():
            noisy = ranges + RANGE_SD * self.normal(index, FAN_RAY_COUNT)
            ranges = np.where(hits, np.minimum(np.maximum(noisy, PROFILER_MIN_RANGE), PROFILER_MAX_RANGE), math.inf)
        ranges.flags.writeable = False
        return ProfileReading(time_ns=self.simulation.now, sample=index, ranges=ranges)

    def describe(self) -> dict[str, Any]:
        """What viewers draw of it: a fan."""
        source = self.world_T_sensor @ Pose((0.0, 0.0, FAN_HEIGHT))
        figures = {"near": 0.0, "far": PROFILER_MAX_RANGE, "angle": FAN_HALF_ANGLE}
        return super().describe() | {"form": "fan", "position": source.position} | figures

    def overlay(self) -> dict[str, Any]:
        """What viewers draw of a reading now."""
        ranges = self.read().ranges
        return {"sees": bool(np.isfinite(ranges).any()), "ranges": [_shown(each) for each in ranges[::_SHOWN_RAYS]]}
