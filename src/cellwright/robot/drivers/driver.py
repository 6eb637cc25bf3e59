"""What stands between the node and a robot: the simulation, or a real one."""

from __future__ import annotations

from typing import Protocol

from cellwright.robot.servos import Array, JointReadings


class Driver(Protocol):
    """A robot's joints, as the node drives and reads them.

    Every array is in the order of `joints`: one number each [rad; m]. Targets are finite, within the limits of the
    joints, and past all safety.
    """

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints with one degree of freedom, in the order of their indices."""
        ...

    def command(self, targets: Array) -> None:
        """Go to these positions; called before a step, and only when they have changed."""
        ...

    def read(self) -> JointReadings:
        """The joints as they are now; called after a step."""
        ...

    def close(self) -> None:
        """Let go of the robot, which is to stand still from then on."""
        ...
