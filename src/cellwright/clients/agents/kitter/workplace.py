"""Workplace of the kitter: bins, belts and stations of the cell, in the frame of the arm.

All poses and points of the kitter are in the arm's frame, as `cellwright.motion.arm_frame` defines it. To the kitter
this is the world, as in `world_T_part`. What the cell sends is turned into it on arrival.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from cellwright.clients.agents.kitter.postures import Postures
from cellwright.config.layout.layout import Belt, Bin, Layout, Station
from cellwright.util.pose import Pose, Vector3

SQUARE = 1e-4
"""Difference [rad] up to which a tray counts as at a right angle to the rail: the original's models are rounded."""

FOLLOWED = 0.3
"""Length [m] of the way on which the arm follows a part on the belt."""

_PART = 0.1
"""Distance [m] from a part's origin to its foremost point that is kept from the end of a belt."""
_STEP = 0.1
_HOVER = 0.1
"""Height [m] of the gripper above the belt for which its reach is computed."""
_DROP_MARGIN = 0.25


@dataclass(frozen=True, slots=True)
class Area:
    """A box, from its corner of smallest coordinates to that of largest [m]."""

    low: Vector3
    high: Vector3

    @classmethod
    def around(cls, points: Iterable[Vector3], margin: float = 0.0) -> Area:
        """Return the smallest box that holds all points and a margin [m] around them."""
        xs, ys, zs = zip(*points, strict=True)
        low = (min(xs) - margin, min(ys) - margin, min(zs) - margin)
        return cls(low, (max(xs) + margin, max(ys) + margin, max(zs) + margin))

    @classmethod
    def over(cls, pose: Pose, size: tuple[float, float], surface: float, height: float) -> Area:
        """Return the box around a rectangle about a pose, `height` [m] below and above a surface."""
        corners = [
            pose.transform((size[0] / 2 * along, size[1] / 2 * across, 0.0)) for along in (-1, 1) for across in (-1, 1)
        ]
        return cls.around((x, y, z) for x, y, _ in corners for z in (surface - height, surface + height))

    def meets(self, other: Area) -> bool:
        """Return whether two boxes have a point in common."""
        return all(self.low[axis] <= other.high[axis] and other.low[axis] <= self.high[axis] for axis in range(3))


@dataclass(frozen=True, slots=True)
class TrayPlace:
    """A station with its tray: an AGV at its load point, or a fixed tray; `rail` is the rail's place [m] for it.

    Attributes:
        number: its number, as in the names of its tray and its quality control sensor.
        name: its name in topics and services.
        location: its name as a storage unit.
        world_T_tray: pose of its tray.
        rail: the rail's place for work at it [m].
        half: half edge lengths of its plate along x and y of the tray [m].
        surface: height of the surface that parts lie on [m].
        has_quality_sensor: True if faulty parts on it are detected.
    """

    number: int
    name: str
    location: str
    world_T_tray: Pose
    rail: float
    half: tuple[float, float]
    surface: float
    has_quality_sensor: bool = True

    @property
    def title(self) -> str:
        """Its name in texts for people."""
        return f"AGV {self.number}" if self.name == f"agv{self.number}" else self.name

    @property
    def area(self) -> Area:
        """The box that holds the parts on its tray."""
        return Area.over(self.world_T_tray, (2 * self.half[0], 2 * self.half[1]), self.surface, 0.02)

    def covers(self, x: float, y: float) -> bool:
        """Return whether a point is over its plate."""
        at = self.world_T_tray.inverse().transform((x, y, self.world_T_tray.position[2]))
        return abs(at[0]) < self.half[0] and abs(at[1]) < self.half[1]


@dataclass(frozen=True, slots=True)
class BeltPlace:
    """A belt, and where along it the arm takes parts.

    Places on it are coordinates `along` the direction of travel [m].

    Attributes:
        belt: the belt.
        first: place from which parts are taken.
        last: place up to which they are.
    """

    belt: Belt
    first: float = -math.inf
    last: float = math.inf

    @property
    def end(self) -> float:
        """Place where parts leave it."""
        return self.belt.exit

    @property
    def area(self) -> Area:
        """The box that holds the parts on it."""
        return Area.over(self.belt.centre, self.belt.size[:2], self.belt.surface, 0.02)

    def point(self, along: float) -> tuple[float, float]:
        """Return x, y [m] of a place in the middle of its width."""
        dx, dy, _ = self.belt.direction
        across = self.across(self.belt.centre.position)
        return dx * along - dy * across, dy * along + dx * across

    def across(self, point: Vector3) -> float:
        """Return the coordinate of a point across the belt [m]."""
        dx, dy, _ = self.belt.direction
        return dx * point[1] - dy * point[0]

    def moved(self, pose: Pose, time: float) -> Pose:
        """Return a pose that the belt carries on for a time [s], which may be negative."""
        x, y, z = pose.position
        dx, dy, _ = self.belt.direction
        way = self.belt.speed * time
        return Pose((x + dx * way, y + dy * way, z), pose.quaternion)

    def is_crossed_by(self, world_T_beam: Pose) -> bool:
        """Return whether a beam runs across the belt, low enough to meet flat parts."""
        dx, dy, _ = world_T_beam.rotate((1.0, 0.0, 0.0))
        direction = self.across((dx, dy, 0.0))
        start = self.across(world_T_beam.position)
        low, high = sorted((start, start + direction))
        return (
            abs(direction) > 0.99
            and low < self.across(self.belt.centre.position) < high
            and self.belt.surface < world_T_beam.position[2] < self.belt.surface + 0.0075
        )


class Workplace:
    """Places of a cell, in the arm's frame.

    Args:
        layout: the layout of the cell, in the world, as `Client.layout` returns it.
        postures: those of the arm.
    """

    def __init__(self, layout: Layout, postures: Postures) -> None:
        self.postures = postures
        self._world_T_arm = postures.world_T_frame
        self.arm_T_world = self._world_T_arm.inverse()
        """Pose of the world in the arm's frame."""
        local = layout.moved(self.arm_T_world)
        lower = self._world_T_arm.position[2]
        self.bins: tuple[Bin, ...] = tuple(replace(each, surface=each.surface - lower) for each in local.bins)
        self.bin_areas = [Area.over(each.pose, each.size, each.surface, 0.3) for each in self.bins]
        self.stations: Mapping[int, TrayPlace] = {
            each.number: self._tray_place(each, lower, has_quality_sensor=each in local.carriers)
            for each in local.stations
        }
        self.others: tuple[TrayPlace, ...] = ()
        """Stations at which other arms work."""
        found = (self._within_reach(each) for each in local.belts)
        self.belts: tuple[BeltPlace, ...] = tuple(each for each in found if each is not None)
        """The belts that the arm reaches."""

    @cached_property
    def highest(self) -> float:
        """Height [m] of the highest surface of bins and trays."""
        surfaces = [*(each.surface for each in self.bins), *(each.surface for each in self.stations.values())]
        return max(surfaces, default=0.0)

    @property
    def drop_places(self) -> list[tuple[float, float, float]]:
        """Places to drop a part on the floor that have nothing under them: x, y [m], and the rail's place."""
        return [(x, y, rail) for x, y, rail in self.postures.figures.drop_places if not self._is_used(x, y)]

    def in_world(self, x: float, y: float) -> tuple[float, float]:
        """Return x, y [m] of a point in the world."""
        return self._world_T_arm.transform((x, y, 0.0))[:2]

    def bin_at(self, x: float, y: float) -> Bin | None:
        """Return the bin over which a point is; None if it is over none."""
        return next((each for each in self.bins if each.covers(x, y)), None)

    def belt(self, name: str) -> BeltPlace | None:
        """Return a belt with the stretch that the arm reaches; None if it reaches none."""
        return next((each for each in self.belts if each.belt.name == name), None)

    def rail_beside(self, x: float, y: float) -> float:
        """Return the rail's usual place for work at a point [m], which may be beyond its end."""
        return self.postures.rail_beside(x, y)

    def rail_along(self, belt: BeltPlace, along: float) -> float:
        """Return the rail's place [m] for a part that is met at a place of a belt and followed from there."""
        # 0.15 m at the speed of 2017's belt: in the middle of the way
        dx, dy, _ = belt.belt.direction
        way = belt.belt.speed * 0.15 / 0.2
        return self.rail_beside(*belt.point(along)) + self.postures.rail_shift(dx * way, dy * way)

    def _is_used(self, x: float, y: float) -> bool:
        corners = [(x + _DROP_MARGIN * i, y + _DROP_MARGIN * j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
        covers = [each.covers for each in self.bins]
        covers += [each.belt.covers for each in self.belts]
        covers += [each.covers for each in (*self.stations.values(), *self.others)]
        return any(each(*corner) for each in covers for corner in corners)

    def _tray_place(self, station: Station, lower: float, *, has_quality_sensor: bool) -> TrayPlace:
        x, y, _ = station.tray_frame.position
        yaw = station.tray_frame.yaw
        quarters = round(yaw / (math.pi / 2))
        if abs(yaw - quarters * math.pi / 2) < SQUARE:
            yaw = (2 if quarters == -2 else quarters) * (math.pi / 2)
        return TrayPlace(
            station.number,
            station.name,
            f"{station.name}_load_point" if has_quality_sensor else station.name,
            Pose.from_rpy(station.tray_frame.position, (0.0, 0.0, yaw)),
            self.postures.on_rail(self.rail_beside(x, y)),
            (station.plate[0] / 2, station.plate[1] / 2),
            station.surface - lower,
            has_quality_sensor,
        )

    def _within_reach(self, belt: Belt) -> BeltPlace | None:
        """Return a belt with the longest stretch on which the arm can follow parts; None if there is none."""
        place = BeltPlace(belt)
        middle = belt.along(belt.centre.position)
        count = math.ceil(belt.size[0] / _STEP)
        marks = [middle + belt.size[0] * (index / count - 0.5) for index in range(count + 1)]
        best: list[float] = []
        stretch: list[float] = []
        for mark in marks:
            stretch = (
                [*stretch, mark] if mark + FOLLOWED <= place.end - _PART and self._is_in_reach(place, mark) else []
            )
            best = max(best, stretch, key=len)
        if not best:
            return None
        first, last = best[0], best[-1]
        if abs(belt.direction[1]) > 0.99:
            lowest, highest = self.postures.figures.belt_ends
            first, last = max(first, lowest), min(last, highest)
        return BeltPlace(belt, first, last) if first < last else None

    def _is_in_reach(self, place: BeltPlace, along: float) -> bool:
        """Return whether the arm can follow a part from a place of a belt on."""
        rail, height = self.rail_along(place, along), place.belt.surface + _HOVER
        points = (place.point(along + way) for way in (0.0, FOLLOWED))
        return all(self.postures.reaches(Pose((x, y, height)), rail) for x, y in points)
