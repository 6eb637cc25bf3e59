"""The node of a robot as the workplace of a policy: its joints, its grippers, its cameras, and the tips of its arms."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from cellwright.clients.client.pictures import LatestPicture
from cellwright.clients.client.session import NodeClient
from cellwright.clients.operators.robot import MoveGrippers, MoveJoints, command_message
from cellwright.clients.policies.cell_workplace import position_reader, robot_camera, tool_arm
from cellwright.clients.policies.key_map import Cell
from cellwright.clients.policies.targets import ToolArm
from cellwright.clients.policies.workplace import Reader
from cellwright.config.control import ControlSpace, side_name
from cellwright.config.layout.robots import NAMESPACE
from cellwright.config.robot.cameras import picture_cameras
from cellwright.config.robot.config import RobotConfig
from cellwright.middleware.messages.cellwright_msgs import TeleopStatus
from cellwright.motion.robot_arms import RobotArm, robot_arms

STATES, GRIPPERS, STATUS = (f"/io_teleop/{name}" for name in ("joint_states", "gripper_states", "status"))
"""Topics that tell where joints and grippers are, and whether the node takes commands."""


class RobotWorkplace:
    """Workplace of a policy at a robot's node; its attributes are those of `Workplace`.

    Args:
        client: client of the node.
        robot: the robot.
        timestep: length of a tick [s], as numerator and denominator.
    """

    def __init__(self, client: NodeClient, robot: RobotConfig, timestep: tuple[int, int]) -> None:
        self.client, self.sentence = client, ""
        self.names = robot_names(robot, timestep)
        space = self.names.space
        self.arms: Mapping[str, ToolArm] = {arm.name: tool_arm(arm, space) for arm in _arms(robot, space)}
        self._status = client.latest(STATUS)

    def start(self) -> None:
        """Wait until the node takes commands."""
        self.client.wait_until(self.takes_commands)

    def is_over(self) -> bool:
        """Return False: a node works on until it is stopped."""
        return False

    def takes_commands(self) -> bool:
        """Return whether the node is enabled, not stopped, and not on its way home."""
        status = self._status.message
        return status is not None and takes_commands(status)

    def camera(self, name: str) -> LatestPicture:
        """Return the newest picture of a camera."""
        return robot_camera(self.client, NAMESPACE, name)

    def readers(self) -> list[Reader]:
        """Return what reads each channel."""
        channels = self.names.space.channels
        states = self.client.latest(STATES)
        found = [(position_reader(states, each.joint), states) for each in channels if each.kind == "joint"]
        if len(found) < len(channels):
            closed = self.client.latest(GRIPPERS)
            names = [f"gripper_{number}" for number in range(len(channels) - len(found))]
            found += [(position_reader(closed, name), closed) for name in names]
        return found

    def commander(self, period: int, channels: Collection[str]) -> RobotCommands:  # noqa: ARG002 - see there
        """Return what sends targets of these channels."""
        return RobotCommands(self.client, self.names.space, channels)


def takes_commands(status: TeleopStatus) -> bool:
    """Return whether a node with this status is enabled, not stopped, and not on its way home."""
    return status.enabled and not status.emergency_stop and not status.resetting


class RobotCommands:
    """Commands of a robot's node, which goes to targets at once: joints in each period, grippers when they change.

    Args:
        client: client of the node.
        space: the channels.
        channels: names of those that are commanded; other joints are left to other clients.
    """

    def __init__(self, client: NodeClient, space: ControlSpace, channels: Collection[str]) -> None:
        self._client = client
        self._joints = {
            each.joint: number
            for number, each in enumerate(space.channels)
            if each.kind == "joint" and each.name in channels
        }
        self._first_gripper = sum(each.kind == "joint" for each in space.channels)
        self._last: list[float] = []

    def begin(self, values: Sequence[float]) -> None:
        """Begin at the present values of the channels."""
        self._last = list(values)

    def send(self, targets: Sequence[float]) -> None:
        """Send the targets of all channels."""
        if self._joints:
            self._send(MoveJoints({name: targets[number] for name, number in self._joints.items()}))
        grippers = list(targets[self._first_gripper :])
        if grippers != self._last[self._first_gripper :]:
            self._send(MoveGrippers(tuple(grippers)))
        self._last = list(targets)

    def _send(self, order: MoveJoints | MoveGrippers) -> None:
        self._client.publish(*command_message(order, self._client.transport.now()))


def robot_names(robot: RobotConfig, timestep: tuple[int, int]) -> Cell:
    """Return the names of a robot's node, without the node."""
    space = ControlSpace.of_node(robot)
    arms = {arm.name: [joint.name for joint in arm.chain.joints] for arm in _arms(robot, space)}
    grippers = {side_name(number): f"gripper_{side_name(number)}" for number in range(len(robot.grippers))}
    return Cell(space, list(picture_cameras(robot)), arms, timestep, grippers)


def _arms(robot: RobotConfig, space: ControlSpace) -> list[RobotArm]:
    """Return the arms whose joints are channels, and not those of a gripper."""
    return [
        arm
        for arm in robot_arms(robot)
        if all(joint.name in space.names for chain in (arm.mount, arm.chain) if chain for joint in chain.joints)
    ]
