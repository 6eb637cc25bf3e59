"""Things in a cell as upright boxes: which overlap, and which stand in the way of an AGV."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

from cellwright.config.layout.layout import Carrier
from cellwright.config.layout.surroundings import Block
from cellwright.config.trial.trial import Trial
from cellwright.util.pose import Pose

AGV_SIZE = (0.673, 1.171, 1.44)
"""Edges of an AGV's bumper along x and y, and the height of its column [m]."""
_TOUCHING = 0.005
"""Overlap [m] up to which things count as touching."""
_STEP = 0.1
"""Distance of the places along a path that are tested [m]."""


@dataclass(frozen=True, slots=True)
class Obstacle:
    """Upright box.

    Attributes:
        key: dotted path to its description.
        name: its name.
        middle: its middle on the floor, with its yaw.
        size: edge lengths along x and y of `middle` [m].
        low: height of its lower side [m].
        high: height of its upper side [m].
    """

    key: str
    name: str
    middle: Pose
    size: tuple[float, float]
    low: float
    high: float

    @property
    def corners(self) -> list[tuple[float, float]]:
        """Corners of its floor plan, around its edge."""
        a, b = self.size[0] / 2, self.size[1] / 2
        seen = (self.middle.transform((x, y, 0.0)) for x, y in ((a, b), (-a, b), (-a, -b), (a, -b)))
        return [(x, y) for x, y, _ in seen]

    @property
    def radius(self) -> float:
        """Radius of a circle around its floor plan [m]."""
        return math.hypot(*self.size) / 2

    def overlap(self, other: Obstacle) -> float:
        """Return the depth of the overlap with another box [m]; 0 or less if there is none."""
        depth = min(self.high, other.high) - max(self.low, other.low)
        apart = math.dist(self.middle.position[:2], other.middle.position[:2]) - self.radius - other.radius
        if depth <= 0.0 or apart >= 0.0:
            return min(depth, -apart)
        for box in (self, other):
            for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)):
                nx, ny, _ = box.middle.rotate(axis)
                spans = [[nx * x + ny * y for x, y in each.corners] for each in (self, other)]
                depth = min(depth, max(spans[0]) - min(spans[1]), max(spans[1]) - min(spans[0]))
        return depth


def obstacles(trial: Trial) -> tuple[Obstacle, ...]:
    """Return what stands in a trial's cell, AGVs at their stations."""
    layout = trial.layout
    return (
        *(
            Obstacle(
                f"cell.bins.{each.name}",
                each.name,
                each.pose,
                (each.size[0] + 2 * each.gap, each.size[1] + 2 * each.gap),
                0.0,
                each.surface + each.walls,
            )
            for each in layout.bins
        ),
        *(
            Obstacle(f"cell.belts.{each.name}", each.name, each.centre, each.size[:2], 0.0, each.surface)
            for each in layout.belts
        ),
        *(_agv(each) for each in trial.carriers),
        *(
            Obstacle(f"cell.trays.{each.name}", each.name, each.pose, each.size, 0.0, each.surface + each.rim)
            for each in layout.trays
        ),
        *(
            _block(f"cell.structure.{each.name}", each.name, each.pose, block)
            for each in layout.structure
            for block in each.boxes
        ),
    )


def overlaps(found: Sequence[Obstacle]) -> Iterator[tuple[Obstacle, Obstacle, float]]:
    """Yield the pairs of things that overlap, each pair of descriptions once, with the depth [m]."""
    reported = set()
    for one, other in combinations(found, 2):
        pair = (one.key, other.key)
        if one.key != other.key and pair not in reported and (depth := one.overlap(other)) > _TOUCHING:
            reported.add(pair)
            yield one, other, depth


def blocked_paths(trial: Trial, found: Sequence[Obstacle]) -> Iterator[tuple[Carrier, Obstacle, tuple[float, float]]]:
    """Yield each AGV with what it runs into on its way, and its place there: the first for each thing.

    What it overlaps at its station is no matter of its path.
    """
    for carrier in trial.carriers:
        agv = _agv(carrier)
        home_T_agv = carrier.home.inverse() @ agv.middle
        others = [each for each in found if each.key != agv.key and agv.overlap(each) <= _TOUCHING]
        hit = set()
        for x, y in _places(carrier):
            moved = replace(agv, middle=Pose((x, y, 0.0), carrier.home.quaternion) @ home_T_agv)
            for other in others:
                if other.key not in hit and moved.overlap(other) > _TOUCHING:
                    hit.add(other.key)
                    yield carrier, other, (x, y)


def world_path(carrier: Carrier) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """Return the corners of an AGV's way out and of its way back, in the world [m]."""
    # key frames count along the axes, and the first is at the station
    _, x0, y0 = carrier.out[0]
    (ax, ay, _), (bx, by, _) = carrier.axes
    hx, hy, _ = carrier.home.position

    def place(x: float, y: float) -> tuple[float, float]:
        return hx + (x - x0) * ax + (y - y0) * bx, hy + (x - x0) * ay + (y - y0) * by

    return [place(x, y) for _, x, y in carrier.out], [place(x, y) for _, x, y in carrier.back]


def _agv(carrier: Carrier) -> Obstacle:
    """Return the box around an AGV and its tray."""
    width, length, height = AGV_SIZE
    front = max(length / 2, carrier.home_T_tray.position[1] + carrier.plate[1] / 2)
    size = (max(width, carrier.plate[0]), length / 2 + front)
    middle = carrier.home @ Pose((0.0, (front - length / 2) / 2, 0.0))
    return Obstacle(f"cell.carriers.{carrier.name}", carrier.name, middle, size, 0.1, height)


def _block(key: str, name: str, frame: Pose, block: Block) -> Obstacle:
    middle = frame @ block.middle
    x, y, z = middle.position
    half = block.size[2] / 2
    return Obstacle(key, name, Pose((x, y, 0.0), middle.quaternion), block.size[:2], z - half, z + half)


def _places(carrier: Carrier) -> Iterator[tuple[float, float]]:
    for way in world_path(carrier):
        for (x0, y0), (x1, y1) in pairwise(way):
            steps = max(1, math.ceil(math.hypot(x1 - x0, y1 - y0) / _STEP))
            for step in range(steps + 1):
                yield x0 + (x1 - x0) * step / steps, y0 + (y1 - y0) * step / steps
