"""Commands of a client that make targets of channels happen, as messages and calls that any program may send."""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import groupby

from cellwright.clients.client.arm import ClientArm
from cellwright.clients.client.client import Client
from cellwright.config.control import SUCTION_ON, Channel, ControlSpace
from cellwright.middleware.messages.conversions import NANOSECONDS, joint_state

Send = Callable[[Sequence[float]], None]


class Commands:
    """Commands for one control period: a straight way to the targets of an arm's joints, its gripper when that changes.

    Args:
        client: client of the cell.
        space: the channels.
        period: length of a control period [ns].
    """

    def __init__(self, client: Client, space: ControlSpace, period: int) -> None:
        self._client, self._period = client, period / NANOSECONDS
        self._last: list[float] = []
        self._sends: list[Send] = []
        groups = groupby(enumerate(space.channels), key=lambda each: (each[1].robot, each[1].arm, each[1].kind))
        for (robot, namespace, kind), members in groups:
            places, channels = zip(*members, strict=True)
            part = slice(places[0], places[-1] + 1)
            if robot:
                self._sends.append(partial(self._send_robot, _topic_of(client, robot), part, channels))
                continue
            arm: ClientArm = client.arm(namespace) if namespace else client
            if kind == "joint":
                self._sends.append(partial(self._send_arm, arm, part, [each.joint for each in channels]))
            else:
                send = self._send_suction if kind == "suction" else self._send_width
                self._sends.append(partial(send, arm, places[0]))

    def begin(self, values: Sequence[float]) -> None:
        """Begin at the present values of the channels."""
        self._last = list(values)

    def send(self, targets: Sequence[float]) -> None:
        """Send the targets of all channels, for the end of the period that begins now."""
        for send in self._sends:
            send(targets)
        self._last = list(targets)

    def _send_arm(self, arm: ClientArm, part: slice, joints: Sequence[str], targets: Sequence[float]) -> None:
        arm.send_arm([targets[part]], [self._period], joints=joints)

    def _send_suction(self, arm: ClientArm, place: int, targets: Sequence[float]) -> None:
        is_on = targets[place] > SUCTION_ON
        if is_on != (self._last[place] > SUCTION_ON):
            arm.control_gripper(is_on)

    def _send_width(self, arm: ClientArm, place: int, targets: Sequence[float]) -> None:
        if targets[place] != self._last[place]:
            arm.command_gripper(targets[place])

    def _send_robot(self, topic: str, part: slice, channels: Sequence[Channel], targets: Sequence[float]) -> None:
        names = [each.joint for each in channels]
        self._client.publish(topic, joint_state(names, targets[part]))


def _topic_of(client: Client, robot: str) -> str:
    """Return the topic of a robot's targets."""
    return next(f"/{each.namespace}/joint_cmd" for each in client.layout().robots if each.name == robot)
