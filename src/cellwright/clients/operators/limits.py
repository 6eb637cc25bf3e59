"""The limits of a robot's joints, as far as an operator knows them: the node clamps, and does not say at what."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from cellwright.config.robot.model import Limits, RobotModel
from cellwright.util.errors import UsageError

_SLACK = 2e-3  # [rad; m] that a joint that was measured at its limit may lie outside; the node cuts it off

_UNKNOWN = Limits()


@dataclass(frozen=True)
class JointLimits:
    """Limits by joint; a joint that is not there has none that anybody knows.

    Attributes:
        joints: by name.
        source: where they are from, for people; empty where nothing is known.
    """

    joints: Mapping[str, Limits] = field(default_factory=dict)
    source: str = ""

    @classmethod
    def of(cls, robot: RobotModel) -> JointLimits:
        """Those of a robot's description."""
        return cls({joint.name: joint.limits for joint in robot.driven}, robot.name)

    def of_joint(self, name: str) -> Limits:
        """The limits of a joint, infinite where nothing is known."""
        return self.joints.get(name, _UNKNOWN)

    def clamped(self, name: str, position: float) -> float:
        """A position [rad; m] within the limits of a joint."""
        limits = self.of_joint(name)
        return min(max(position, limits.lower), limits.upper)

    def check(self, name: str, low: float, high: float, what: str) -> None:
        """Refuse a way of a joint that leaves its limits.

        Args:
            name: of the joint.
            low: the lower end of the way [rad; m].
            high: the upper one.
            what: what would take this way, for people.

        Raises:
            UsageError: it leaves them.
        """
        limits = self.of_joint(name)
        if low < limits.lower - _SLACK or high > limits.upper + _SLACK:
            raise UsageError(
                f"{name}: {what} would go from {low:.4g} to {high:.4g}, and its limits ({self.source}) are "
                f"{limits.lower:.4g} to {limits.upper:.4g}"
            )

    @property
    def is_known(self) -> bool:
        """Whether anything is known."""
        return any(math.isfinite(limit.upper - limit.lower) for limit in self.joints.values())
