"""Arms of a layout: where each stands, what carries it, and what it holds parts with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

from cellwright.config.arm import RAIL_LIMIT
from cellwright.config.gripper import ParallelGripperSettings
from cellwright.config.gripper_links import GripperNames, palm_T_grasp
from cellwright.config.layout.surroundings import Block, Structure
from cellwright.config.ur10 import GRIPPER
from cellwright.util.pose import Pose, Vector3

MAX_ARMS = 8
"""Maximum number of arms in a cell: the engine tells them apart by bits."""
ORIGINAL = "ur10"
"""Model of the arm of 2017: a UR10 on a rail, with its cup."""

MountKind: TypeAlias = Literal["floor", "pedestal", "table", "rail", "link"]
"""Kind of thing that carries an arm."""

Axis: TypeAlias = Literal["x", "y"]
ToolKind: TypeAlias = Literal["vacuum", "parallel", "none"]
JointNames: TypeAlias = Literal["plain", "prefixed"]

DriveKind: TypeAlias = Literal["stiff", "as_given"]
"""Drives of an arm: by the inertia of its joints, or those of its MJCF file."""

HOLDERS: Mapping[ToolKind, str] = {"vacuum": GRIPPER, "parallel": GripperNames().palm}
"""Link of each kind of tool that holds parts."""

_PEDESTAL = 0.24
"""Edge of a pedestal [m]."""
_TOP, _LEG = 0.04, 0.06
"""Thickness of a table's top, and edge of its legs [m]."""


@dataclass(frozen=True, slots=True)
class OnLink:
    """Place of an arm on a link of another arm or of a robot, with which it moves.

    Attributes:
        arm: the other arm, which has a model of its own; empty on a robot.
        robot: the robot; empty on an arm.
        link: its link, by the name in its file.
        pose: frame of the mount in that of the link.
    """

    arm: str
    robot: str
    link: str
    pose: Pose

    @property
    def carrier(self) -> str:
        """Name of the arm or robot that carries it."""
        return self.arm or self.robot

    @property
    def body(self) -> str:
        """Name of the link in the engine."""
        return f"{self.carrier}/{self.link}"


@dataclass(frozen=True, slots=True)
class Mount:
    """Mount of an arm.

    Attributes:
        kind: kind of its carrier.
        pose: frame of the arm's root link in the world; of a rail its own frame, in which the arm moves. On a link it
            is that of the mount as a run begins, with what carries it at home.
        axis: direction of a rail, in its frame.
        range: ends of the arm's way along a rail [m].
        speed: maximum speed along a rail [m/s].
        effort: maximum force of a rail's drive [N].
        size: edges of a table's top [m].
        on: link that carries the arm; None if it stands in the world.
    """

    kind: MountKind
    pose: Pose
    axis: Axis = "y"
    range: tuple[float, float] = (-1.0, 1.0)
    speed: float = 1.0
    effort: float = 1000.0
    size: tuple[float, float] = (1.0, 1.0)
    on: OnLink | None = None

    @property
    def ends(self) -> tuple[Vector3, Vector3]:
        """Ends of the way of the arm's base in the world [m]; equal unless it is on a rail."""
        ends = self.range if self.kind == "rail" else (0.0, 0.0)
        x, y = (1.0, 0.0) if self.axis == "x" else (0.0, 1.0)
        first, last = (self.pose.transform((end * x, end * y, 0.0)) for end in ends)
        return first, last

    def structure(self, name: str) -> Structure | None:
        """Return what stands under the arm, as a structure of the cell; None if nothing of its own does."""
        height = self.pose.position[2]
        if self.kind == "pedestal" and height > 0.0:
            return Structure(name, self.pose, (Block(Pose((0.0, 0.0, -height / 2)), (_PEDESTAL, _PEDESTAL, height)),))
        if self.kind == "table" and height > _TOP:
            x, y = ((edge - _LEG) / 2 for edge in self.size)
            legs = tuple(
                Block(Pose((side * x, end * y, -(height + _TOP) / 2)), (_LEG, _LEG, height - _TOP))
                for side in (-1, 1)
                for end in (-1, 1)
            )
            return Structure(name, self.pose, (Block(Pose((0.0, 0.0, -_TOP / 2)), (*self.size, _TOP)), *legs))
        return None


def original_mount(pose: Pose) -> Mount:
    """Return the mount of the arm of 2017, by the frame of its rail in the world."""
    return Mount("rail", pose, range=(-RAIL_LIMIT, RAIL_LIMIT), speed=3.0)


@dataclass(frozen=True, slots=True)
class Tool:
    """Tool at the tip of an arm, along its z axis.

    Attributes:
        kind: `vacuum`: a suction cup with a round face; `parallel`: a gripper with two fingers; `none`: the arm holds
            nothing.
        length: distance of the cup's face from the tip [m], or of the middle between the pads.
        fingers: settings of a parallel gripper; None for another tool.
    """

    kind: ToolKind = "vacuum"
    length: float = 0.1
    fingers: ParallelGripperSettings | None = None

    @property
    def palm_distance(self) -> float:
        """Distance of a parallel gripper's palm from the tip [m]."""
        return 0.0 if self.fingers is None else max(0.0, self.length - grasp_distance(self.fingers))


def grasp_distance(fingers: ParallelGripperSettings) -> float:
    """Return the distance [m] between the middle of the pads and the palm's back: the least length of such a tool."""
    return palm_T_grasp(fingers).position[2]


@dataclass(frozen=True, slots=True)
class Arm:
    """Arm of a cell.

    Attributes:
        name: its name in the layout.
        mount: its carrier.
        model: its model as written: `ur10` for the arm of 2017, else the path of a robot's description.
        tip: link that carries the tool; the last one of the chain of 2017's arm.
        tool: its gripper.
        home: posture in which a run begins [rad; m], by joint; other joints at 0.
        bandwidth: angular frequency of its drives [rad/s].
        namespace: namespace of its topics and services below `/ariac`; empty for those without one.
        names: names of its joints in messages: `plain`, or `prefixed` by the arm's name.
    """

    name: str
    mount: Mount
    model: str = ORIGINAL
    tip: str = ""
    tool: Tool = field(default_factory=Tool)
    home: dict[str, float] = field(default_factory=dict, hash=False)
    bandwidth: float = 80.0
    namespace: str = ""
    names: JointNames = "plain"

    @property
    def is_original(self) -> bool:
        """True for the arm of 2017."""
        return self.model == ORIGINAL

    @property
    def pose(self) -> Pose:
        """Frame of its mount in the world, as a run begins."""
        return self.mount.pose

    @property
    def prefix(self) -> str:
        """Prefix of its links and joints in the engine; those of 2017's arm have none."""
        return "" if self.is_original and not self.namespace else f"{self.name}/"

    @property
    def start_prefix(self) -> str:
        """Prefix of its joints in the postures that a run begins in, which name those of all arms."""
        return f"{self.name}/" if self.namespace else ""

    @property
    def joint_prefix(self) -> str:
        """Prefix of its joints in messages."""
        return f"{self.name}_" if self.names == "prefixed" else ""

    @property
    def gripper_names(self) -> GripperNames:
        """Names of a parallel gripper in the engine."""
        return GripperNames(self.prefix)

    @property
    def finger_joints(self) -> tuple[str, ...]:
        """Joints of the fingers in messages; none without a parallel gripper."""
        return GripperNames(self.joint_prefix).joints if self.tool.kind == "parallel" else ()

    @property
    def holder(self) -> str:
        """Link that holds parts, by its name in the engine: the cup's or the palm; the tip if it has no tool."""
        return self.prefix + HOLDERS.get(self.tool.kind, self.tip)

    @property
    def frame_prefix(self) -> str:
        """Prefix of its frames, and of its links and joints in the robot description of all arms."""
        return f"{self.name}_" if self.namespace else ""

    def frame_of(self, link: str) -> str:
        """Return the frame of a link, by the link's name in the engine."""
        return self.frame_prefix + link.removeprefix(self.prefix)

    def moved(self, by: Pose) -> Arm:
        """Return the arm moved by a pose of the world."""
        return replace(self, mount=replace(self.mount, pose=by @ self.mount.pose))
