"""Postures as the kitter asks an arm for them, whatever its model: a protocol, and the figures of an arm.

Vectors have one number a joint, in the order of the controller: positions [rad], or [m] of a rail, which comes first. A
`rail` is a place on it [m]; it means nothing to an arm without one. Poses and points are in the frame of the kitter,
and the tool is the link of the cup.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from cellwright.motion.solver import Vector
from cellwright.util.pose import Pose


class Heights(NamedTuple):
    """Heights of the tool [m].

    Attributes:
        travel: between stations, with one of the parts of 2017 on the cup.
        hover: lowest height from which it goes down to a part at rest.
        waiting: posture in which it waits for a belt, and drops discarded parts.
    """

    travel: float
    hover: float
    waiting: float


@dataclass(frozen=True, slots=True)
class ArmFigures:
    """Figures of an arm.

    Attributes:
        joints: names of the joints in messages.
        gripper: name of the link of the cup.
        is_soft: True if the servo of each joint gives way to weight, so that commands are corrected for it.
        speed: maximum speed of each joint on a path of the tool [rad/s; m/s].
        steps: largest motion of each joint between two places of a path that are looked at [rad; m].
        home: a usual posture, in which no link hits another.
        carriers: names of the bodies that carry it.
        heights: heights of the tool.
        drop_places: places x, y [m] where a part can be dropped on the floor, and the rail's for each.
        belt_ends: places along a belt beside the rail between which parts are taken from it [m].
    """

    joints: tuple[str, ...]
    gripper: str
    is_soft: tuple[bool, ...]
    speed: Vector
    steps: Vector
    home: Vector
    carriers: frozenset[str]
    heights: Heights
    drop_places: tuple[tuple[float, float, float], ...]
    belt_ends: tuple[float, float] = (-math.inf, math.inf)


class Knots(NamedTuple):
    """Motion of the joints from rest to rest: their positions at times [s], the present ones first, and velocities."""

    times: Sequence[float]
    positions: Sequence[Sequence[float]]
    velocities: Sequence[Sequence[float]]


class Postures(Protocol):
    """Postures of an arm, and ways between them."""

    @property
    def figures(self) -> ArmFigures:
        """Its figures."""
        ...

    @property
    def world_T_frame(self) -> Pose:
        """Pose of the frame of the kitter in the world."""
        ...

    @property
    def frame_T_base(self) -> Pose:
        """Pose of the frame of its mount."""
        ...

    def tool(self, q: Sequence[float]) -> Pose:
        """Return the pose of the tool."""
        ...

    def rail_at(self, x: float, y: float) -> float:
        """Return the rail's place nearest to a point [m], which may be beyond its end."""
        ...

    def rail_beside(self, x: float, y: float) -> float:
        """Return the rail's usual place for work at a point [m], which may be beyond its end."""
        ...

    def rail_shift(self, dx: float, dy: float) -> float:
        """Return by how much the rail's place changes for a point that moves [m]."""
        ...

    def on_rail(self, rail: float) -> float:
        """Return the place on the rail [m] nearest to one that may be beyond its end."""
        ...

    def rails(self, goal: Pose, rail: float) -> Iterable[float]:
        """Return the rail's places worth trying for a pose [m], the usual one `rail` first."""
        ...

    def way_to(self, q: Sequence[float], x: float, y: float) -> tuple[float, float]:
        """Return a key that is smaller for a point nearer to where the arm stands."""
        ...

    def reaches(self, goal: Pose, rail: float) -> bool:
        """Return whether it reaches a pose as usual, wherever it is now."""
        ...

    def usual(self, goal: Pose, rail: float, present: Sequence[float]) -> Iterator[Vector]:
        """Yield usual postures for a pose with the cup facing down, those near the present one first."""
        ...

    def again(self, goal: Pose, chosen: Vector, present: Sequence[float]) -> Vector | None:
        """Return a usual posture that was chosen for a pose, as the arm takes it from where it is now."""
        ...

    def sideways(self, goal: Pose, rail: float, present: Sequence[float]) -> Vector | None:
        """Return a posture for a pose with the cup facing sideways, the arm above the hand; None if out of reach."""
        ...

    def step(self, goal: Pose, near: Sequence[float]) -> Vector | None:
        """Return the posture for a pose close by, with the rail where it is; None if it is out of reach."""
        ...

    def ways(self, start: Sequence[float], goal: Vector, extra: float) -> Iterator[list[Vector]]:
        """Yield postures to stop at on the way between two, the shortest way first; all lead to the goal.

        The tool is kept `extra` higher than usual [m].
        """
        ...

    def rolled(self, q: Sequence[float], angle: float) -> Vector:
        """Return a posture with the tool turned about its axis by an angle [rad], or by its opposite, within limits."""
        ...

    def motion(self, start: Sequence[float], stops: Iterable[Sequence[float]]) -> Knots:
        """Return the motion from one posture to others, with a rest at each."""
        ...
