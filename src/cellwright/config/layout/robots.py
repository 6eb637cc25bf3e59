"""Robots of the robot face in a layout: where each stands, and the namespace of its topics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product

from cellwright.config.robot.config import RobotConfig, initial_posture
from cellwright.config.robot.model import link_poses
from cellwright.util.pose import Pose, Vector3

MAX_ROBOTS = 8
"""Maximum number of robots in a cell: the engine tells them apart by bits."""
NAMESPACE = "io_teleop"
"""Namespace of a robot's topics, if it has no other."""


@dataclass(frozen=True, slots=True)
class Hand:
    """Hand that holds a part: one that is near its grasp point when it closes.

    Attributes:
        name: its name among all that can hold a part, `ROBOT/right`.
        side: number of the gripper and of the arm in the robot's configuration: 0 is right, 1 left.
        link: link whose origin is the grasp point.
        reach: distance [m] from there to a part that it can hold.
    """

    name: str
    side: int
    link: str
    reach: float


@dataclass(frozen=True, slots=True)
class CellRobot:
    """Robot of a cell that is driven over its own topics.

    Attributes:
        name: its name in the layout.
        model: the robot as written: a bundled one, or the path of its configuration or description.
        pose: frame in the world of its root link, or of the link that its configuration fixes.
        namespace: namespace of its topics.
        hands: the hands that hold parts; without any, they only push.
        box: opposite corners of the space [m] that its links take as a run begins, in the frame of its pose.
    """

    name: str
    model: str
    pose: Pose
    namespace: str = NAMESPACE
    hands: tuple[Hand, ...] = ()
    box: tuple[Vector3, Vector3] = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))

    @property
    def prefix(self) -> str:
        """Prefix of its links, joints and devices in the simulation."""
        return f"{self.name}/"

    @property
    def base(self) -> str:
        """Body in the simulation that carries it."""
        return f"{self.prefix}place"

    @property
    def frame_prefix(self) -> str:
        """Prefix of its frames."""
        return f"{self.name}_"

    def frame_of(self, link: str) -> str:
        """Return the frame of a link, by the link's name in the simulation."""
        return self.frame_prefix + link.removeprefix(self.prefix)

    @property
    def corners(self) -> tuple[Vector3, ...]:
        """Corners of its `box` in the world [m]."""
        return tuple(self.pose.transform((x, y, z)) for x, y, z in product(*zip(*self.box, strict=True)))

    def moved(self, by: Pose) -> CellRobot:
        """Return the robot moved by a pose of the world."""
        return replace(self, pose=by @ self.pose)


def robot_links(robot: CellRobot, config: RobotConfig, positions: Mapping[str, float] | None = None) -> dict[str, Pose]:
    """Return the poses of a robot's links in the world, by their names in its file.

    Args:
        robot: the robot.
        config: its configuration.
        positions: positions of its joints [rad; m]; by default those of the start of a run.
    """
    poses = link_poses(config.robot, initial_posture(config) if positions is None else positions)
    world_T_root = robot.pose @ poses[config.fixed_link or config.robot.root].inverse()
    return {name: world_T_root @ pose for name, pose in poses.items()}
