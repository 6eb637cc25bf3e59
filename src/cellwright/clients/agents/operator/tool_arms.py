"""Arms of a cell as a person works them: those of its layout, with what carries them, and those of its robots."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from cellwright.clients.agents.kitter.described_arm import behind
from cellwright.clients.client.client import Client
from cellwright.clients.policies.targets import ToolArm
from cellwright.config.layout.arms import Arm
from cellwright.config.layout.robots import CellRobot
from cellwright.motion.chain import Chain
from cellwright.motion.robot_arms import RobotArm
from cellwright.util.pose import Pose, Vector3

ALONG, AGAINST = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)


@dataclass(frozen=True)
class OperatedArm:
    """An arm that a person works.

    Attributes:
        name: its name: as in the layout, `ROBOT/right` of a robot.
        joints: names of its joints in messages, first those that carry it.
        tool: the arm, by places among these joints.
        arm: its entry in the layout; None for an arm of a robot.
        robot: the robot's entry in the layout; None for another arm.
        outward: direction out of the tool, in its frame; None where that is unknown.
        has_place: False if it stands on a link that moves, so that its place in the world is not known.
    """

    name: str
    joints: tuple[str, ...]
    tool: ToolArm
    arm: Arm | None = None
    robot: CellRobot | None = None
    outward: Vector3 | None = None
    has_place: bool = True

    @property
    def can_be_upright(self) -> bool:
        """True if it is known which way its tool points."""
        return self.outward is not None and self.has_place

    @property
    def chain(self) -> Chain:
        """The arm alone, from the frame of what carries it to its tool."""
        return self.tool.chain

    @property
    def has_rail(self) -> bool:
        """True if its first joint is that of a rail."""
        return self.arm is not None and self.arm.mount.kind == "rail"

    @property
    def limits(self) -> list[tuple[float, float, float]]:
        """Lower and upper limit [rad; m] and greatest speed [rad/s; m/s] of each joint."""
        carriers = () if self.tool.mount is None else self.tool.mount.joints
        return [(joint.lower, joint.upper, joint.speed) for joint in (*carriers, *self.chain.joints)]

    def world_T_tool(self, q: Sequence[float]) -> Pose:
        """Return the pose of its tool at positions of its joints [rad; m]."""
        return self.tool.world_T_base(q) @ self.tool.base_T_tool(q)


def operated_arms(client: Client) -> list[OperatedArm]:
    """Return all arms of a cell that a person can work: one for each arm of the layout, and of its robots.

    Example:
        >>> from cellwright import Cell, Client, load_trial
        >>> [arm.name for arm in operated_arms(Client.in_process(Cell(load_trial("lesson"))))]
        ['arm']
    """
    layout = client.layout()
    return list(arms_of(layout.arms, client.chains(), layout.robots, client.robot_arms()))


def arms_of(
    arms: Sequence[Arm],
    chains: Mapping[str, Chain],
    robots: Sequence[CellRobot],
    robot_arms: Mapping[str, Sequence[RobotArm]],
) -> Iterator[OperatedArm]:
    """Yield the arms that a cell describes; arguments as a `Client` returns them."""
    for arm in arms:
        if arm.name in chains:
            yield _of_layout(arm, chains[arm.name])
    for robot in robots:
        for each in robot_arms.get(robot.name, ()):
            yield _of_robot(robot, each)


def _of_layout(arm: Arm, chain: Chain) -> OperatedArm:
    names = tuple(joint.name for joint in chain.joints)
    if arm.mount.kind == "rail":
        rail = Chain(chain.joints[:1], Pose())
        tool = ToolArm(behind(chain), arm.pose, tuple(range(1, len(names))), rail, (0,))
    else:
        tool = ToolArm(chain, arm.pose, tuple(range(len(names))))
    # the z axis of the cup's link points into the arm, that of any other tip out of it
    outward = AGAINST if arm.tool.kind == "vacuum" else ALONG
    return OperatedArm(arm.name, names, tool, arm, outward=outward, has_place=arm.mount.on is None)


def _of_robot(robot: CellRobot, arm: RobotArm) -> OperatedArm:
    carriers = () if arm.mount is None else arm.mount.joints
    names = tuple(joint.name for joint in (*carriers, *arm.chain.joints))
    places = tuple(range(len(carriers), len(names)))
    tool = ToolArm(replace(arm.chain, links={}), arm.world_T_begin, places, arm.mount, tuple(range(len(carriers))))
    return OperatedArm(f"{robot.prefix}{arm.name}", names, tool, robot=robot)
