"""An arm of a cell with its messages, as the operator agent commands it."""

from __future__ import annotations

from collections.abc import Sequence

from cellwright.clients.agents.operator.tool_arms import OperatedArm
from cellwright.clients.client.arm import ClientArm
from cellwright.clients.client.client import Client
from cellwright.clients.client.session import Latest
from cellwright.middleware.messages.conversions import joint_state


class Device:
    """An arm of the cell, with its messages: over the topics of an arm, or those of its robot.

    Args:
        client: client of the cell.
        operated: the arm.
    """

    def __init__(self, client: Client, operated: OperatedArm) -> None:
        self.operated = operated
        self._client, self._hand = client, None if operated.arm is None else _hand(client, operated.arm.namespace)
        self._topic = "" if operated.robot is None else f"/{operated.robot.namespace}/joint_cmd"
        self.states: Latest
        if operated.robot is not None:
            self.states = client.latest(f"/{operated.robot.namespace}/joint_states")
        else:
            assert self._hand is not None
            self.states = self._hand.joint_states

    def measured(self) -> list[float]:
        """Return the newest positions of its joints [rad; m]."""
        message = self.states.message
        found = dict(zip(message.name, map(float, message.position), strict=True))
        return [found[name] for name in self.operated.joints]

    def has_part(self) -> bool:
        """Return whether it holds something."""
        return self._hand is not None and self._hand.gripper_attached

    def send(self, targets: Sequence[float], period: float) -> None:
        """Send targets of its joints [rad; m] for the end of the period that begins now."""
        if self._hand is None:
            self._client.publish(self._topic, joint_state(self.operated.joints, targets))
        else:
            self._hand.send_arm([targets], [period], joints=self.operated.joints)

    def stop(self) -> None:
        """Bring it to rest where it is."""
        if self._hand is None:
            self._client.publish(self._topic, joint_state(self.operated.joints, self.measured()))
        else:
            self._hand.send_arm([], joints=self.operated.joints)


def _hand(client: Client, namespace: str) -> ClientArm:
    return client.arm(namespace) if namespace else client
