"""Joint positions of the arm as one value with named fields, their ranges, and motion limits."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple, TypeAlias, Union

from cellwright.config.arm import ARM_JOINTS, RAIL_LIMIT, TURN_LIMIT
from cellwright.motion.turns import FULL_TURN, ROUNDING, turn_range, turned, turns_to
from cellwright.util.errors import UnknownNameError, UsageError

LIMITS: tuple[float, ...] = (RAIL_LIMIT, *(TURN_LIMIT,) * 6)
"""Range of each joint to either side [m for the rail; rad], in the order of the fields of `Joints`."""

JointsLike: TypeAlias = Union["Joints", Mapping[str, float]]
"""Joint positions [m for the rail; rad], as `Joints` or by joint name."""


class Joints(NamedTuple):
    """Positions of the seven joints, or their velocities, in the order of the arm's controller.

    Attributes:
        rail: along world y [m].
        shoulder_pan: [rad], as all that follow.
        shoulder_lift: larger values lower the upper arm; 0 lays it flat.
        elbow: 0 where the arm is straight.
        wrist_1: in the plane of upper arm and forearm, as the two before.
        wrist_2: -pi/2 where the tool points down and the hand reaches outward.
        wrist_3: about the tool's axis.
    """

    rail: float
    shoulder_pan: float
    shoulder_lift: float
    elbow: float
    wrist_1: float
    wrist_2: float
    wrist_3: float

    @classmethod
    def of(cls, positions: JointsLike) -> Joints:
        """Return the joints of a mapping by joint name (`client.joint_positions`), or `Joints` as they are.

        Names of other joints are ignored, as joint states name the gripper too.

        Example:
            >>> Joints.of({**STILL.by_name(), "elbow_joint": 1.5}).elbow
            1.5

        Raises:
            UnknownNameError: one of the arm's joints is missing.
            UsageError: a position is not finite, or positions have no names.
        """
        if not isinstance(positions, Joints):
            if not isinstance(positions, Mapping):
                raise UsageError(
                    f"joint positions: a {type(positions).__name__} names no joints, and lists of the client have "
                    "another order; give Joints(rail, shoulder_pan, …) or a mapping by joint name"
                )
            for name in ARM_JOINTS:
                if name not in positions:
                    raise UnknownNameError("arm joint", name, positions)
            positions = cls(*(float(positions[name]) for name in ARM_JOINTS))
        if not all(map(math.isfinite, positions)):
            raise UsageError(f"joint positions must be finite (got {tuple(positions)})")
        return positions

    def by_name(self) -> dict[str, float]:
        """Return the values by joint name."""
        return dict(zip(ARM_JOINTS, self, strict=True))

    def ordered(self, names: Sequence[str]) -> list[float]:
        """Return the values in the order of `names`, for instance `cellwright.clients.client.ARM_JOINTS`.

        Raises:
            UnknownNameError: one of them is no joint of the arm.
        """
        values = self.by_name()
        for name in names:
            if name not in values:
                raise UnknownNameError("arm joint", name, ARM_JOINTS)
        return [values[name] for name in names]

    def within_limits(self) -> bool:
        """Return whether all joints are within their limits."""
        return all(abs(value) <= limit + ROUNDING for value, limit in zip(self, LIMITS, strict=True))

    def nearest(self, near: Joints) -> Joints:
        """Return the same posture, with whole turns added to each angle, within limits, to be nearest to `near`."""
        return Joints(self.rail, *turned_near(self[1:], near[1:]))

    def turned(self) -> Iterator[Joints]:
        """Yield every choice of whole turns within limits that is the same posture, including this one."""
        for angles in product(*map(_turns, self[1:])):
            yield Joints(self.rail, *angles)


STILL = Joints(*(0.0,) * 7)
"""Velocities of joints at rest."""


def _turns(angle: float) -> list[float]:
    """Return the angles [rad] that differ from `angle` by whole turns and lie within the limits, rising."""
    low, high = turn_range(angle, -TURN_LIMIT, TURN_LIMIT)
    return [turned(angle, turns, -TURN_LIMIT, TURN_LIMIT) for turns in range(low, high + 1)]


def turned_near(angles: Sequence[float], near: Sequence[float]) -> Iterator[float]:
    """Return angles plus the whole turns, within limits, that bring each nearest to that of `near` [rad]."""
    return map(_nearest_turn, angles, near)


def _nearest_turn(angle: float, near: float) -> float:
    """Return the one of `_turns` that is nearest to `near`; the lower one of two that are equally near."""
    if -math.pi < near - angle <= math.pi and -TURN_LIMIT <= angle <= TURN_LIMIT:
        # fast path for most calls
        return angle
    if -TURN_LIMIT <= (nearest := angle + turns_to(angle, near) * FULL_TURN) <= TURN_LIMIT:
        return nearest
    low, high = turn_range(angle, -TURN_LIMIT, TURN_LIMIT)
    return turned(angle, max(low, min(high, turns_to(angle, near))), -TURN_LIMIT, TURN_LIMIT)


@dataclass(frozen=True, slots=True)
class MotionLimits:
    """Maximum velocity, acceleration and jerk of each joint, in m and s for the rail, rad and s for the others.

    Raises:
        UsageError: one of them is not a positive finite number.
    """

    velocity: Joints
    acceleration: Joints
    jerk: Joints

    def __post_init__(self) -> None:
        for value in (*self.velocity, *self.acceleration, *self.jerk):
            if not 0.0 < value < math.inf:
                raise UsageError(f"motion limits must be positive and finite (got {value})")

    def slower(self, factor: float) -> MotionLimits:
        """Return the limits under which a motion from rest to rest takes `factor` times as long.

        Raises:
            UsageError: `factor` is not above 0 and finite.
        """
        if not 0.0 < factor < math.inf:
            raise UsageError(f"factor must be positive and finite (got {factor})")
        return MotionLimits(
            Joints(*(value / factor for value in self.velocity)),
            Joints(*(value / factor**2 for value in self.acceleration)),
            Joints(*(value / factor**3 for value in self.jerk)),
        )


DEFAULT_LIMITS = MotionLimits(
    velocity=Joints(1.5, 2.0, 2.0, 2.5, 3.0, 3.0, 3.0),
    acceleration=Joints(4.0, 8.0, 8.0, 12.0, 16.0, 16.0, 16.0),
    jerk=Joints(40.0, 80.0, 80.0, 120.0, 160.0, 160.0, 160.0),
)
"""Default limits, with velocities a little below the published ones (3 m/s; 2.16, 2.16, 3.15, 3.2 rad/s).

With the original's servos the rail lags with acceleration (13 mm at 4 m/s^2), the wrists with velocity. Accelerations
above these make motions hardly shorter."""
