"""Where the joints are, by the newest joint states."""

from __future__ import annotations

from cellwright.clients.client import Client
from cellwright.config.layout import ARM_JOINTS
from cellwright.middleware.messages.build import NANOSECONDS
from cellwright.motion import Joints, forward
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose

PATIENCE = 1.0


class JointWatch:
    """Reads joint states when they are asked for; most come and go unread.

    Args:
        client: whose arm.

    Raises:
        UsageError: the arm says nothing for a second.
    """

    def __init__(self, client: Client) -> None:
        self._states = client.joint_states
        if self._states.wait_for_next(PATIENCE) is None:
            raise UsageError("the arm does not tell where its joints are: nothing on /ariac/joint_states")
        self._read = 0
        self._positions = Joints(*(0.0,) * 7)

    @property
    def positions(self) -> Joints:
        """Positions [m for the rail; rad]."""
        if self._read != self._states.count:
            self._read = self._states.count
            message = self._states.message
            positions = dict(zip(message.name, message.position.tolist(), strict=True))
            self._positions = Joints(*(positions[name] for name in ARM_JOINTS))
        return self._positions

    @property
    def time(self) -> float:
        """When they were there [s]."""
        stamp = self._states.message.header.stamp
        return float((stamp.sec * NANOSECONDS + stamp.nanosec) / NANOSECONDS)

    @property
    def tool(self) -> Pose:
        """world_T_gripper then."""
        return forward(self.positions)
