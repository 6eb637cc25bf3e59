"""Range sensors: rays from one point, and the break beam, proximity sensor and laser profiler that cast them."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar, NamedTuple, TypeVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from cellwright.engine.device import State
from cellwright.engine.sensor import Reading, Sensor
from cellwright.engine.simulation import Simulation
from cellwright.util.pose import Pose, Vector3

SOLID_GROUPS = (1, 3)
"""Geom groups that stop a ray: solids. Visual shapes, such as a sensor's own housing, are in group 2."""

_SOLID_GROUP_MASK = np.array([group in SOLID_GROUPS for group in range(mujoco.mjNGROUP)], dtype=np.uint8)

_MARGIN = 1e-6
"""Margin of the ball around a geom [m]: rounding must not hide an intersection that the engine would find."""

_SHOWN_RAYS = 8
"""Interval of the rays of a profile that viewers show."""

_FAR_AWAY = 1e9
"""Coordinate beyond the reach of every ray [m]."""

_MAX_BALL = 0.5
"""Maximum radius of a ball around several geoms [m]."""
R = TypeVar("R", bound=Reading)
RANGE_SD = 0.001
"""Standard deviation of a measured range [m]."""
CONE_HALF_ANGLE = 0.0625
"""Half the opening of the proximity sensor's cone, horizontally and vertically [rad]."""
FAN_HALF_ANGLE = 0.251
"""Half the opening of the laser profiler's fan, about the z axis of the sensor [rad]."""
FAN_RAY_COUNT = 400
FAN_ANGLE_STEP = 2 * FAN_HALF_ANGLE / (FAN_RAY_COUNT - 1)
"""Angle between two neighbouring rays [rad]."""


def ray_fan(horizontal: NDArray[np.float64], vertical: NDArray[np.float64]) -> list[Vector3]:
    """Return unit directions about +x, one for each pair of angles [rad]; horizontal angles vary fastest.

    A horizontal angle turns towards +y, a vertical one towards +z.
    """
    return [
        (math.cos(v) * math.cos(h), math.cos(v) * math.sin(h), math.sin(v))
        for v in vertical.tolist()
        for h in horizontal.tolist()
    ]


class _Ball(NamedTuple):
    """Ball around geoms of one body; its middle is that of the first geom.

    Attributes:
        geoms: ids of the geoms.
        radius: [m]
    """

    geoms: NDArray[np.intp]
    radius: float


def _balls(model: mujoco.MjModel, geoms: NDArray[np.intp]) -> list[_Ball]:
    """Return a ball around all geoms of a body; of a large body, a ball around each of them."""
    places, radii = model.geom_pos[geoms], model.geom_rbound[geoms]
    extents = (np.linalg.norm(places[:, None] - places, axis=2) + radii).max(axis=1)
    middle = int(extents.argmin())
    if extents[middle] > _MAX_BALL:
        return [_Ball(geoms[index : index + 1], float(radii[index])) for index in range(len(geoms))]
    return [_Ball(np.roll(geoms, -middle), float(extents[middle]))]


class Rays:
    """Bundle of rays that start `nearest` away from one point and end `farthest` away from it [m].

    An object nearer than `nearest` does not stop a ray, which begins behind it. A ray that begins within a solid meets
    the solid's far side. The directions are unit vectors in the frame of the point, `world_T_source`.
    """

    def __init__(
        self, world_T_source: Pose, directions: list[Vector3], *, nearest: float = 0.0, farthest: float
    ) -> None:
        self.nearest = nearest
        self.farthest = farthest
        self.count = len(directions)
        self._source = np.array(world_T_source.position)
        self._directions = np.array([world_T_source.rotate(direction) for direction in directions])
        axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        self._axes = np.array([world_T_source.rotate(axis) for axis in axes])
        ends = farthest * np.array([[0.0, 0.0, 0.0], *directions]).T
        low, high = ends.min(axis=1, keepdims=True), ends.max(axis=1, keepdims=True)
        self._middle, self._half = self._axes @ self._source[:, None] + (low + high) / 2, (high - low) / 2
        # the box along the world's axes around all rays
        self._world_middle = self._axes.T @ self._middle
        self._world_half = np.abs(self._axes.T) @ self._half
        self._data: mujoco.MjData | None = None
        # the engine's array of the geoms' middles
        self._places = np.empty((0, 3))
        self._balls: list[_Ball] = []
        # coordinates of the balls' middles, in `geom_xpos`
        self._coordinates: NDArray[np.intp] = np.empty((3, 0), dtype=np.intp)
        self._ball_middles, self._ball_reaches = np.empty((3, 0)), np.empty((3, 0))
        self._radii, self._reaches = np.empty(0), np.empty((3, 0))  # by geom
        self._fixed = np.empty(0)
        # true if a fixed object stops a ray before it begins
        self._begins_in_fixed = False

    def cast(self, simulation: Simulation) -> NDArray[np.float64]:
        """Return the length of each ray from the source [m], shape (count,); `inf` if nothing stops it.

        Positions must be up to date (`Simulation.refresh`). Fixed objects are tested once; after that a ray is cast
        only if a movable object is near it.
        """
        if simulation.data is not self._data:
            self._find_fixed(simulation)
        distances = self._fixed.copy()
        near = self._near()
        if not (near.size or self._begins_in_fixed):
            return distances
        if near.size:
            to_movable = self._cast_rays(simulation.model, simulation.data, self._directions[near], with_fixed=False)
            distances[near] = np.minimum(distances[near], to_movable)
        for ray in np.flatnonzero(distances < self.nearest):
            distances[ray] = self._beyond_nearest(simulation, self._directions[ray])
        return distances

    def first(self, simulation: Simulation) -> float:
        """Return the length of the first ray from the source [m]; `inf` if nothing stops it.

        It is that of `cast`, bit for bit. For one ray the selection by balls costs more than the engine's own search.
        """
        direction = self._directions[0]
        distance = mujoco.mj_ray(
            simulation.model, simulation.data, self._source, direction, _SOLID_GROUP_MASK, True, -1, None
        )
        if 0.0 <= distance < self.nearest:
            return self._beyond_nearest(simulation, direction)
        return float(distance) if 0.0 <= distance <= self.farthest else math.inf

    def _near(self) -> NDArray[np.intp]:
        """Return the indices of the rays that pass through a ball around a movable object, in ascending order."""
        # first, and mostly sufficient: objects near the box around all rays; arrays of one shape are fastest
        offsets = self._places.take(self._coordinates)
        offsets -= self._ball_middles
        x, y, z = np.abs(offsets, out=offsets) <= self._ball_reaches
        close: NDArray[np.intp] = (x & y & z).nonzero()[0]
        if not close.size:
            return close
        # then their geoms near the box around all rays, along the axes of the source
        geoms = np.concatenate([self._balls[ball].geoms for ball in close.tolist()])
        places = self._places.take(geoms, axis=0)
        is_within = np.abs(self._axes @ places.T - self._middle) <= self._reaches[:, geoms]
        within: NDArray[np.intp] = is_within.all(axis=0).nonzero()[0]
        if not within.size:
            return within
        offsets, radii = places[within] - self._source, self._radii[geoms[within]]
        # an object behind the source is as far from a ray as from the source
        # A ray passes within r of a point at the offset o if o^2 - (o . direction)^2 <= r^2.
        along = np.maximum(self._directions @ offsets.T, 0.0)
        meets = np.einsum("gi,gi->g", offsets, offsets) - along**2 <= radii**2
        return np.flatnonzero(meets.any(axis=1))

    def _find_fixed(self, simulation: Simulation) -> None:
        """Find the movable objects, and the length of each ray among the fixed ones."""
        model = simulation.model
        moves = model.body_weldid[model.geom_bodyid] != 0
        movable = np.flatnonzero(moves & np.isin(model.geom_group, SOLID_GROUPS))
        self._radii = model.geom_rbound + _MARGIN
        self._reaches = self._half + self._radii
        bodies = model.geom_bodyid[movable]
        self._balls = [ball for body in np.unique(bodies) for ball in _balls(model, movable[bodies == body])]
        middles = np.array([ball.geoms[0] for ball in self._balls], dtype=np.intp)
        self._coordinates = 3 * middles + np.arange(3)[:, None]
        radii = np.array([ball.radius for ball in self._balls])
        self._ball_reaches = self._world_half + radii + _MARGIN
        self._ball_middles = np.repeat(self._world_middle, len(middles), axis=1)
        self._data, self._places = simulation.data, simulation.data.geom_xpos
        # With all movable objects far away, rays against fixed ones are cast once for the whole run.
        alone = mujoco.MjData(model)
        mujoco.mj_kinematics(model, alone)
        alone.geom_xpos[movable] = _FAR_AWAY
        self._fixed = self._cast_rays(model, alone, self._directions)
        self._begins_in_fixed = bool((self._fixed < self.nearest).any())

    def _cast_rays(
        self, model: mujoco.MjModel, data: mujoco.MjData, directions: NDArray[np.float64], *, with_fixed: bool = True
    ) -> NDArray[np.float64]:
        """Return the lengths of rays from the source to their first hit [m], shape (count,); `inf` without a hit."""
        count = len(directions)
        lengths = np.empty(count)
        flat, geoms, without = directions.ravel(), np.empty(count, dtype=np.int32), -1  # -1: exclude no body
        options = (flat, _SOLID_GROUP_MASK, with_fixed, without, geoms, lengths, None, count, self.farthest)
        mujoco.mj_multiRay(model, data, self._source, *options)
        return np.where((lengths >= 0.0) & (lengths <= self.farthest), lengths, math.inf)

    def _beyond_nearest(self, simulation: Simulation, direction: NDArray[np.float64]) -> float:
        """Return the distance of one ray that would be stopped before it begins [m]."""
        start = self._source + self.nearest * direction
        beyond = mujoco.mj_ray(simulation.model, simulation.data, start, direction, _SOLID_GROUP_MASK, True, -1, None)
        distance = self.nearest + float(beyond)
        return distance if beyond >= 0.0 and distance <= self.farthest else math.inf


class RangeSensor(Sensor[R]):
    """Base of sensors that cast rays from one point. Arguments as in `Sensor`."""

    source: ClassVar[Vector3]
    """Origin of the rays in the sensor's frame [m]."""
    directions: ClassVar[list[Vector3]]
    nearest: ClassVar[float] = 0.0
    farthest: ClassVar[float]
    """Maximum range from the source [m]; `nearest` is the minimum."""
    figures: ClassVar[dict[str, Any]]
    """Figures for viewers besides the pose; see `Sensor.describe`."""

    def attach(self, simulation: Simulation) -> None:
        """Attach to a simulation and set up the rays."""
        super().attach(simulation)
        source = self.world_T_sensor @ Pose(self.source)
        self._rays = Rays(source, self.directions, nearest=self.nearest, farthest=self.farthest)

    def describe(self) -> dict[str, Any]:
        """Return the description for viewers: a ray, a cone or a fan."""
        return super().describe() | self.figures


def _shown(length: float) -> float | None:
    return round(float(length), 4) if math.isfinite(length) else None


@dataclass(frozen=True, slots=True, kw_only=True)
class BeamReading(Reading):
    """State of the beam, and the distance of an object in it from the ray's beginning [m]; `inf` without one."""

    detected: bool
    range: float


class BreakBeam(RangeSensor[BeamReading]):
    """Break beam; the ray runs along the +x axis of its pose.

    It measures with and without subscribers: whether a reading is a change must not depend on them.
    """

    default_period: ClassVar[Fraction] = Fraction(1, 20)
    source: ClassVar[Vector3] = (0.025, 0.0, 0.0)
    directions: ClassVar[list[Vector3]] = [(1.0, 0.0, 0.0)]
    farthest: ClassVar[float] = 1.0
    figures: ClassVar[dict[str, Any]] = {"form": "beam", "near": source[0], "far": farthest}

    def attach(self, simulation: Simulation) -> None:
        """Attach to a simulation and begin to measure."""
        super().attach(simulation)
        self._detected = self._has_changed = False
        self._arm()

    def measure(self, index: int) -> BeamReading:
        """Measure whether the beam is interrupted now."""
        distance = self._rays.first(self.simulation)
        if math.isfinite(distance):
            noisy = distance + RANGE_SD * float(self.normal(index, 1)[0])
            distance = min(max(noisy, 0.0), self.farthest)
        # at either end of the ray the beam counts as whole, as in the original cell
        detected = 0.0 < distance < self.farthest
        return BeamReading(
            time_ns=self.simulation.now, sample=index, detected=detected, range=distance if detected else math.inf
        )

    def overlay(self) -> dict[str, Any]:
        """Return the overlay of a reading now, for viewers."""
        reading = self.read()
        return {"sees": reading.detected, "ranges": [_shown(reading.range)]}

    def listen_changes(self, callback: Callable[[BeamReading], None]) -> Callable[[], None]:
        """Subscribe, as with `listen`, to readings that differ from the previous one in `detected`.

        The beam counts as whole before the first reading of a run.
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
        """Return the switch, and whether the newest reading found the beam interrupted."""
        return {**super().get_state(), "detected": self._detected}

    def set_state(self, state: State) -> None:
        """Restore what `get_state` returned."""
        super().set_state(state)
        self._detected = state["detected"]

    def _deliver(self, reading: BeamReading) -> None:
        self._has_changed = reading.detected != self._detected
        self._detected = reading.detected
        super()._deliver(reading)

    def _disarm(self) -> None:
        """Keep measuring."""

    def close(self) -> None:
        """Remove all subscribers and stop measuring."""
        super().close()
        super()._disarm()


@dataclass(frozen=True, slots=True, kw_only=True)
class ProximityReading(Reading):
    """Distance to the nearest object in the cone [m], or of the far end without one."""

    range: float


class ProximitySensor(RangeSensor[ProximityReading]):
    """Proximity sensor; it looks along the +x axis of its pose, with 5 x 5 rays."""

    default_period: ClassVar[Fraction] = Fraction(1, 20)
    source: ClassVar[Vector3] = (0.023, 0.0, 0.0)
    directions: ClassVar[list[Vector3]] = ray_fan(*[np.linspace(-CONE_HALF_ANGLE, CONE_HALF_ANGLE, 5)] * 2)
    nearest: ClassVar[float] = 0.01
    farthest: ClassVar[float] = 0.15
    figures: ClassVar[dict[str, Any]] = {"form": "cone", "near": source[0], "far": farthest, "angle": CONE_HALF_ANGLE}

    def measure(self, index: int) -> ProximityReading:
        """Measure the distance of the nearest object now."""
        nearest = float(self._rays.cast(self.simulation).min())
        if nearest < self.farthest:
            # noise on the nearest range: the minimum of 25 noisy ranges would be too short on average
            noisy = nearest + RANGE_SD * float(self.normal(index, 1)[0])
            nearest = max(noisy, self.nearest)
        return ProximityReading(time_ns=self.simulation.now, sample=index, range=min(nearest, self.farthest))

    def overlay(self) -> dict[str, Any]:
        """Return the overlay of a reading now, for viewers."""
        distance = self.read().range
        return {"sees": distance < self.farthest, "ranges": [_shown(distance)]}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ProfileReading(Reading):
    """Outline measured by a laser profiler.

    Attributes:
        ranges: distance along each ray from the source [m], shape (400,), from -0.251 rad to 0.251 rad; `inf` where a
            ray meets nothing. The array is read-only.
    """

    ranges: NDArray[np.float64]


class LaserProfiler(RangeSensor[ProfileReading]):
    """Laser profiler; its fan lies about +x in the x-y plane of its pose."""

    default_period: ClassVar[Fraction] = Fraction(1, 100)
    source: ClassVar[Vector3] = (0.0, 0.0, 0.06)
    directions: ClassVar[list[Vector3]] = ray_fan(
        np.linspace(-FAN_HALF_ANGLE, FAN_HALF_ANGLE, FAN_RAY_COUNT), np.zeros(1)
    )
    nearest: ClassVar[float] = 0.181
    farthest: ClassVar[float] = 0.725
    figures: ClassVar[dict[str, Any]] = {"form": "fan", "near": 0.0, "far": farthest, "angle": FAN_HALF_ANGLE}

    def measure(self, index: int) -> ProfileReading:
        """Measure the outline now."""
        ranges = self._rays.cast(self.simulation)
        misses = ranges == math.inf
        miss_count = np.count_nonzero(misses)
        if miss_count < FAN_RAY_COUNT:
            noisy = self.normal(index, FAN_RAY_COUNT)
            noisy *= RANGE_SD
            noisy += ranges
            np.maximum(noisy, self.nearest, out=noisy)
            ranges = np.minimum(noisy, self.farthest, out=noisy)
            if miss_count:
                ranges[misses] = math.inf
        ranges.flags.writeable = False
        return ProfileReading(time_ns=self.simulation.now, sample=index, ranges=ranges)

    def describe(self) -> dict[str, Any]:
        """Return the description for viewers: a fan that begins at the source."""
        return super().describe() | {"position": (self.world_T_sensor @ Pose(self.source)).position}

    def overlay(self) -> dict[str, Any]:
        """Return the overlay of a reading now, for viewers."""
        ranges = self.read().ranges
        return {"sees": bool(np.isfinite(ranges).any()), "ranges": [_shown(each) for each in ranges[::_SHOWN_RAYS]]}
