"""Solvers of inverse kinematics and mounts of arms, as protocols: a program asks these, whatever the arm.

A solver knows an arm on its base, and a mount the places of that base in the world. So a rail is no joint of the
solver: a program asks the mount for places, and the solver for postures at each.

    for position, world_T_base in mount.places(world_T_tool, present):
        for posture in solver.branches(world_T_base.inverse() @ world_T_tool, near):
            ...

Vectors are tuples of one number a joint, in the order of `Solver.joints`: angles [rad], or positions [m] of prismatic
joints. Velocities are [rad/s] or [m/s].
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple, Protocol, TypeAlias

from cellwright.util.pose import Pose

Vector: TypeAlias = tuple[float, ...]
"""One number a joint, in the order of the joints."""

MAX_STEP = 0.2
"""Maximum motion of a joint between neighbouring poses of a path [rad; m]; more is a jump to another posture."""

TURN_WEIGHT = 0.2
"""Weight of a turn of 1 rad against a motion of 1 m [m]: as in the original's controller; the size of a hand."""


class Margins(NamedTuple):
    """Distance of a posture from where an arm loses mobility.

    Attributes:
        singular: smallest singular value of the tool's Jacobian, with `TURN_WEIGHT` for turns [m]. At 0 there is a
            direction in which the tool cannot move. A joint turns at `speed / singular` at most for a tool at `speed`.
        limit: distance to the nearest limit of a joint [rad; m]; negative beyond it, infinite without limits.
    """

    singular: float
    limit: float


class Solver(Protocol):
    """Inverse kinematics of one arm on its base; the mount, such as a rail, is outside.

    All poses are in the frame of the arm's base. `base_T_tool` is the pose of the frame that the arm brings to a place.
    """

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints, base first."""
        ...

    @property
    def lower(self) -> Vector:
        """Lower limit of each joint [rad; m]; -inf without one."""
        ...

    @property
    def upper(self) -> Vector:
        """Upper limit of each joint [rad; m]; inf without one."""
        ...

    @property
    def speed(self) -> Vector:
        """Maximum speed of each joint [rad/s; m/s]; inf without one."""
        ...

    @property
    def home(self) -> Vector:
        """Home posture [rad; m]."""
        ...

    def links(self, q: Sequence[float]) -> Mapping[str, Pose]:
        """Return base_T_link of all links that the arm carries [m], its tool included; limits are ignored."""
        ...

    def branches(self, base_T_tool: Pose, near: Sequence[float]) -> Iterator[Vector]:
        """Yield the postures within limits that bring the tool to a pose, lazily, the nearest to `near` first.

        Whole turns of a joint are one posture: the one nearest to `near`. Nothing is yielded for a pose out of reach.
        """
        ...

    def step_to(self, base_T_tool: Pose, near: Sequence[float]) -> Vector | None:
        """Return the posture that brings the tool to a pose close by, without a jump to another branch.

        No joint moves by more than `MAX_STEP`. It is None where that is impossible: the pose is out of reach, or the
        way leads through a singularity or a limit.
        """
        ...

    def margin(self, q: Sequence[float]) -> Margins:
        """Return the distances of a posture from singularities and limits."""
        ...


class Place(NamedTuple):
    """A place of an arm's base: the position of its mount [m; 0 for a fixed one], and the pose of the base."""

    position: float
    world_T_base: Pose


class Mount(Protocol):
    """Places at which the base of an arm can stand."""

    def places(self, world_T_tool: Pose, present: float) -> Iterator[Place]:
        """Yield places worth trying for a pose of the tool, those near the present position [m] first."""
        ...


def travel(a: Sequence[float], b: Sequence[float], speed: Sequence[float]) -> float:
    """Return the distance between two postures: the root of the sum of the squares of each joint's time [s].

    A joint without a limit of speed counts as one of 1 rad/s or 1 m/s.

    Example:
        >>> travel((0.0, 1.0), (3.0, 5.0), (1.0, 1.0))
        5.0
    """
    return math.hypot(*((p - q) / (s if s < math.inf else 1.0) for p, q, s in zip(a, b, speed, strict=True)))


def largest_step(a: Sequence[float], b: Sequence[float]) -> float:
    """Return the largest motion of a joint between two postures [rad; m]."""
    return max(abs(p - q) for p, q in zip(a, b, strict=True))
