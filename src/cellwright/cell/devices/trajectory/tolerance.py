"""How far joints may be off while they follow a goal, by the controller's settings and by what a goal asks for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from cellwright.engine.clock import nanoseconds


@dataclass(frozen=True, slots=True)
class AskedTolerance:
    """A tolerance that a goal asks for: position [rad or m], velocity [rad/s or m/s].

    0 leaves the controller's own tolerance, a negative number lifts it.
    """

    joint_name: str
    position: float = 0.0
    velocity: float = 0.0

    def is_finite(self) -> bool:
        """Whether both are numbers."""
        return math.isfinite(self.position) and math.isfinite(self.velocity)


class Tolerance(NamedTuple):
    """How far one joint may be off in position [rad or m] and velocity [rad/s or m/s]; 0 is not checked."""

    position: float = 0.0
    velocity: float = 0.0

    def fault(self, position_error: float, velocity_error: float) -> str:
        """What is wrong with a joint that is off by so much [rad; m] and [rad/s; m/s], or an empty string."""
        if self.position > 0.0 and not abs(position_error) <= self.position:  # so written, what is no number is off too
            return f"position is off by {abs(position_error):.4g}, {self.position:.4g} is allowed"
        if self.velocity > 0.0 and not abs(velocity_error) <= self.velocity:
            return f"velocity is off by {abs(velocity_error):.4g}, {self.velocity:.4g} is allowed"
        return ""

    def overridden(self, position: float, velocity: float) -> Tolerance:
        """This tolerance with what a goal asks for [rad; m] and [rad/s; m/s]."""
        return Tolerance(_override(self.position, position), _override(self.velocity, velocity))


@dataclass(frozen=True, slots=True)
class Tolerances:
    """What a goal is held to: one `Tolerance` per joint on the way and at the end, and the time it may take after it.

    `goal_time` [ns] None waits for ever.
    """

    path: tuple[Tolerance, ...]
    goal: tuple[Tolerance, ...]
    goal_time: int | None = 0

    def overridden(
        self,
        joint_names: Sequence[str],
        path: Sequence[AskedTolerance],
        goal: Sequence[AskedTolerance],
        goal_time: int,
    ) -> Tolerances:
        """These tolerances with what a goal asks for; `goal_time` [ns] follows the same rule as the others."""
        return Tolerances(
            _overridden(self.path, path, joint_names),
            _overridden(self.goal, goal, joint_names),
            self.goal_time if goal_time == 0 else None if goal_time < 0 else goal_time,
        )


def default_tolerances(
    trajectory: Sequence[float], goal: Sequence[float], stopped_velocity: float, goal_time: float
) -> Tolerances:
    """The controller's own tolerances.

    Args:
        trajectory: position tolerance of each joint on the way [rad or m].
        goal: position tolerance of each joint at the end [rad or m].
        stopped_velocity: velocity below which a joint has stopped [rad/s or m/s].
        goal_time: time after the end within which the goal must be reached [s].
    """
    return Tolerances(
        tuple(Tolerance(position) for position in trajectory),
        tuple(Tolerance(position, stopped_velocity) for position in goal),
        nanoseconds(goal_time),
    )


def _override(own: float, asked: float) -> float:
    return own if asked == 0.0 else max(asked, 0.0)


def _overridden(
    own: tuple[Tolerance, ...], asked: Sequence[AskedTolerance], joint_names: Sequence[str]
) -> tuple[Tolerance, ...]:
    result = list(own)
    for one in asked:
        if one.joint_name in joint_names:
            index = joint_names.index(one.joint_name)
            result[index] = result[index].overridden(one.position, one.velocity)
    return tuple(result)
