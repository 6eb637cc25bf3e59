"""A cell as the workplace of a policy: its channels, its cameras, and the tools of its arms and robots."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

from cellwright.clients.client.arm import ClientArm
from cellwright.clients.client.client import Client
from cellwright.clients.client.pictures import LatestPicture, picture_topics
from cellwright.clients.client.session import Latest, NodeClient
from cellwright.clients.policies.commands import Commands
from cellwright.clients.policies.key_map import Cell
from cellwright.clients.policies.targets import ToolArm
from cellwright.clients.policies.workplace import Reader
from cellwright.config.control import Channel, ControlSpace
from cellwright.config.layout.arms import Arm
from cellwright.config.layout.robots import CellRobot
from cellwright.config.robot.cameras import picture_cameras
from cellwright.config.sensors import PictureCameraConfig
from cellwright.config.trial.trial import Trial
from cellwright.motion.robot_arms import RobotArm, robot_arms

_COLOUR = "image_raw"
_OF_ROBOT = re.compile(r"camera_(\w+)/color", re.ASCII)


class CellWorkplace:
    """Workplace of a policy in a cell; its attributes are those of `Workplace`.

    Args:
        client: client of the cell.
    """

    def __init__(self, client: Client) -> None:
        self.client, self._layout = client, client.layout()
        space, chains, of_robots = client.control_space(), client.chains(), client.robot_arms()
        arms = [arm for arm in self._layout.arms if arm.name in chains]
        topics = client.transport.topics()
        firsts = [name.split("/")[2] for name in topics if name.startswith("/ariac/") and name.count("/") > 2]
        cameras = [each for each in dict.fromkeys(firsts) if _COLOUR in picture_topics(f"/ariac/{each}", topics)]
        for robot in self._layout.robots:
            found = (_OF_ROBOT.fullmatch(each.removeprefix(f"/{robot.namespace}/")) for each in topics)
            cameras += [f"{robot.prefix}{each[1]}" for each in found if each]
        robots = [(robot, of_robots.get(robot.name, ())) for robot in self._layout.robots]
        self.names = _names(space, cameras, arms, robots, client.timestep())
        self.sentence = client.sentence
        places = {(each.arm, each.joint): number for number, each in enumerate(space.channels) if not each.robot}
        self.arms: Mapping[str, ToolArm] = {
            arm.name: ToolArm(
                chains[arm.name], arm.pose, tuple(places[arm.namespace, each.name] for each in chains[arm.name].joints)
            )
            for arm in arms
        } | {f"{robot.prefix}{arm.name}": tool_arm(arm, space, robot.prefix) for robot, own in robots for arm in own}

    def start(self) -> None:
        """Start the competition."""
        self.client.start_competition()

    def is_over(self) -> bool:
        """Return whether the competition is done."""
        return self.client.competition_state == "done"

    def takes_commands(self) -> bool:
        """Return True: a cell always takes them."""
        return True

    def camera(self, name: str) -> LatestPicture:
        """Return the newest picture of a camera."""
        robot = next((each for each in self._layout.robots if name.startswith(each.prefix)), None)
        if robot is None:
            return self.client.camera(name)
        return robot_camera(self.client, robot.namespace, name.removeprefix(robot.prefix))

    def readers(self) -> list[Reader]:
        """Return what reads each channel."""
        shared: dict[str, Latest] = {}
        for robot in self._layout.robots:
            shared[robot.name] = self.client.latest(f"/{robot.namespace}/joint_states")
        return [self._reader(channel, shared) for channel in self.names.space.channels]

    def commander(self, period: int, channels: Collection[str]) -> Commands:  # noqa: ARG002 - a cell takes all
        """Return what sends targets, for control periods of this length [ns]."""
        return Commands(self.client, self.names.space, period)

    def _reader(self, channel: Channel, robots: Mapping[str, Latest]) -> Reader:
        if channel.robot:
            return position_reader(robots[channel.robot], channel.joint), robots[channel.robot]
        arm: ClientArm = self.client.arm(channel.arm) if channel.arm else self.client
        if channel.kind == "joint":
            return position_reader(arm.joint_states, channel.joint), arm.joint_states
        if channel.kind == "suction":
            return lambda: float(arm.gripper_enabled), arm.gripper
        return lambda: arm.gripper_width or 0.0, arm.joint_states


def cell_names(trial: Trial) -> Cell:
    """Return the names of a trial's cell, without the cell."""
    cameras = [each.name for each in trial.sensors if isinstance(each, PictureCameraConfig) and each.has_colour]
    robots = []
    for robot in trial.layout.robots:
        model = trial.robot_models[robot.name]
        cameras += [f"{robot.prefix}{name}" for name in picture_cameras(model)]
        robots.append((robot, robot_arms(model, robot.pose)))
    return _names(ControlSpace.of(trial), cameras, trial.arms, robots, trial.settings.timestep)


def tool_arm(arm: RobotArm, space: ControlSpace, prefix: str = "") -> ToolArm:
    """Return an arm of a robot as one whose tool is commanded; `prefix` is that of the robot's channels."""
    joints, carriers = (
        tuple(space.index(f"{prefix}{joint.name}") for joint in (chain.joints if chain else ()))
        for chain in (arm.chain, arm.mount)
    )
    return ToolArm(arm.chain, arm.world_T_begin, joints, arm.mount, carriers)


def robot_camera(client: NodeClient, namespace: str, name: str) -> LatestPicture:
    """Return the newest picture of a robot's camera, by the namespace of its topics: its colours."""
    base = f"/{namespace}/camera_{name}"
    return LatestPicture(client, base, {_COLOUR: f"{base}/color", "camera_info": f"{base}/camera_info"})


def position_reader(states: Latest, joint: str) -> Callable[[], float]:
    """Return what reads the newest position of a joint [rad; m]."""
    return lambda: float(states.message.position[states.message.name.index(joint)])


def _names(
    space: ControlSpace,
    cameras: Sequence[str],
    arms: Iterable[Arm],
    robots: Iterable[tuple[CellRobot, Sequence[RobotArm]]],
    timestep: tuple[int, int],
) -> Cell:
    joints: dict[str, Sequence[str]] = {}
    grippers: dict[str, str] = {}
    for arm in arms:
        own = [each for each in space.channels if not each.robot and each.arm == arm.namespace]
        joints[arm.name] = [each.name for each in own if each.kind == "joint"]
        grippers.update((arm.name, each.name) for each in own if each.kind != "joint")
    for robot, own_arms in robots:
        for each in own_arms:
            joints[f"{robot.prefix}{each.name}"] = [f"{robot.prefix}{joint.name}" for joint in each.chain.joints]
    return Cell(space, cameras, joints, timestep, grippers)
