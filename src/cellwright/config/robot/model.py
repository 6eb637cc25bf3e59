"""Robot model: links in a tree of joints, numbered as PyBullet numbers them, and its forward kinematics.

The index of a joint is its position in a traversal of the tree from the root. Parents come before children, and
children in the order of their `<joint>` elements in the file; fixed joints count. A link has the index of the joint
above it, and the root link has -1. (Measured: PyBullet counts so, and robot configuration files use its indices.)
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property

from cellwright.config.models.model import ModelShape
from cellwright.config.parsing.tree import Definition
from cellwright.util.errors import UnknownNameError
from cellwright.util.pose import Pose, Vector3

ROOT = -1
"""Index of the root link."""


class JointType(StrEnum):
    """Motion of a joint, as URDF names it."""

    FIXED = "fixed"
    REVOLUTE = "revolute"
    CONTINUOUS = "continuous"
    PRISMATIC = "prismatic"
    SPHERICAL = "spherical"
    PLANAR = "planar"
    FLOATING = "floating"

    @property
    def is_driven(self) -> bool:
        """True for one degree of freedom, which a robot program moves."""
        return self in (JointType.REVOLUTE, JointType.CONTINUOUS, JointType.PRISMATIC)


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits of a joint: position from `lower` to `upper` [rad; m], effort [N m; N], velocity [rad/s; m/s].

    They are infinite by default.
    """

    lower: float = float("-inf")
    upper: float = float("inf")
    effort: float = float("inf")
    velocity: float = float("inf")


@dataclass(frozen=True, slots=True)
class Mimic:
    """Coupling to another joint: `multiplier * position of joint + offset` [rad; m]."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class Inertial:
    """Mass [kg], centre of mass and axes in the frame of the link, and inertia [kg m^2] about that centre.

    The inertia is given as (ixx, iyy, izz, ixy, ixz, iyz) along the axes of `pose`.
    """

    mass: float
    pose: Pose = field(default_factory=Pose)
    inertia: tuple[float, float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Link:
    """Link: its name, its mass if the file gives one, and its shapes in its own frame.

    Its `definition` is its place in a file; None for one that is built in code.
    """

    name: str
    inertial: Inertial | None = None
    shapes: tuple[ModelShape, ...] = ()
    definition: Definition | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Joint:
    """Joint between two links; the frame of the child is the frame of the joint.

    `origin` is parent_T_child at position 0. `axis` is a unit vector in the frame of the child, or (0, 0, 0) for types
    without an axis. Its `definition` is its place in a file; None for one that is built in code.
    """

    name: str
    type: JointType
    parent: str
    child: str
    origin: Pose = field(default_factory=Pose)
    axis: Vector3 = (1.0, 0.0, 0.0)
    limits: Limits = field(default_factory=Limits)
    mimic: Mimic | None = None
    definition: Definition | None = field(default=None, compare=False, repr=False)

    @property
    def is_driven(self) -> bool:
        """True if it has one degree of freedom that a program can command."""
        return self.type.is_driven


@dataclass(frozen=True)
class RobotModel:
    """Robot: its links by name, in the order of the file, and its joints in the order of their indices.

    `written` are the names of the joints in the order of their elements in the file; empty if that is the order of
    their indices.
    """

    name: str
    root: str
    links: Mapping[str, Link]
    joints: tuple[Joint, ...]
    written: tuple[str, ...] = ()

    def prefixed(self, prefix: str) -> "RobotModel":
        """Return the robot with a prefix to the names of all links and joints."""
        if not prefix:
            return self
        links = {f"{prefix}{name}": replace(link, name=f"{prefix}{name}") for name, link in self.links.items()}
        joints = (
            replace(
                joint,
                name=f"{prefix}{joint.name}",
                parent=f"{prefix}{joint.parent}",
                child=f"{prefix}{joint.child}",
                mimic=joint.mimic and replace(joint.mimic, joint=f"{prefix}{joint.mimic.joint}"),
            )
            for joint in self.joints
        )
        written = tuple(f"{prefix}{name}" for name in self.written)
        return RobotModel(self.name, f"{prefix}{self.root}", links, tuple(joints), written)

    @cached_property
    def movable(self) -> tuple[Joint, ...]:
        """All joints that are not fixed, in the order of their indices: those of /io_teleop/joint_states."""
        return tuple(joint for joint in self.joints if joint.type is not JointType.FIXED)

    @cached_property
    def driven(self) -> tuple[Joint, ...]:
        """All joints with one degree of freedom, in the order of their indices."""
        return tuple(joint for joint in self.joints if joint.is_driven)

    @cached_property
    def joint_indices(self) -> Mapping[str, int]:
        """Index of each joint by name."""
        return {joint.name: index for index, joint in enumerate(self.joints)}

    @cached_property
    def link_indices(self) -> Mapping[str, int]:
        """Index of each link by name; the root's is -1."""
        return {self.root: ROOT} | {joint.child: index for index, joint in enumerate(self.joints)}

    @cached_property
    def _above(self) -> Mapping[str, Joint]:
        return {joint.child: joint for joint in self.joints}

    def joint(self, name: str) -> Joint:
        """Return a joint by name.

        Raises:
            UnknownNameError: there is no joint of this name.
        """
        index = self.joint_indices.get(name)
        if index is None:
            raise UnknownNameError("joint", name, self.joint_indices)
        return self.joints[index]

    def link_at(self, index: int) -> str:
        """Return the name of the link with an index from -1."""
        return self.root if index == ROOT else self.joints[index].child

    def joint_above(self, link: str) -> Joint | None:
        """Return the joint that moves a link; None for the root."""
        return self._above.get(link)

    def chain(self, link: str) -> tuple[Joint, ...]:
        """Return the joints from the root to a link, in this order."""
        found: list[Joint] = []
        joint = self._above.get(link)
        while joint is not None:
            found.append(joint)
            joint = self._above.get(joint.parent)
        return tuple(reversed(found))


def in_index_order(root: str, joints: Iterable[Joint]) -> list[Joint]:
    """Return the joints below a link in the order of their indices: parents first, children in the order given."""
    below: dict[str, list[Joint]] = {}
    for joint in joints:
        below.setdefault(joint.parent, []).append(joint)
    found: list[Joint] = []
    # Depth first: a stack with the first child on top.
    ahead = list(reversed(below.get(root, ())))
    while ahead:
        joint = ahead.pop()
        found.append(joint)
        ahead.extend(reversed(below.get(joint.child, ())))
    return found


def link_poses(robot: RobotModel, positions: Mapping[str, float], world_T_root: Pose | None = None) -> dict[str, Pose]:
    """Return the pose of each link frame in the world, by name.

    Args:
        robot: the robot.
        positions: positions of joints [rad; m], by name; other joints are at 0, unless they mimic another.
        world_T_root: pose of the root link; the identity by default.

    Example:
        >>> slide = Joint("slide", JointType.PRISMATIC, "base", "cart", Pose((0.0, 0.0, 0.5)))
        >>> robot = RobotModel("rail", "base", {"base": Link("base"), "cart": Link("cart")}, (slide,))
        >>> link_poses(robot, {"slide": 0.2})["cart"].position
        (0.2, 0.0, 0.5)
    """
    poses = {robot.root: world_T_root or Pose()}
    for joint in robot.joints:
        poses[joint.child] = poses[joint.parent] @ parent_T_child(joint, position_of(robot, joint, positions))
    return poses


def position_of(robot: RobotModel, joint: Joint, positions: Mapping[str, float]) -> float:
    """Return the position of a joint [rad; m]: its own, or the one derived from the joint that it mimics."""
    if joint.mimic is not None and joint.name not in positions:
        leader = robot.joint(joint.mimic.joint)
        return joint.mimic.multiplier * position_of(robot, leader, positions) + joint.mimic.offset
    return positions.get(joint.name, 0.0)


def parent_T_child(joint: Joint, position: float) -> Pose:
    """Return the child link's frame in its parent's, at a position [rad; m]; joints that are not driven are at 0."""
    if joint.type is JointType.PRISMATIC:
        x, y, z = joint.axis
        return joint.origin @ Pose((position * x, position * y, position * z))
    if not joint.is_driven:
        return joint.origin
    sine, cosine = math.sin(position / 2), math.cos(position / 2)
    x, y, z = joint.axis
    return joint.origin @ Pose(quaternion=(cosine, sine * x, sine * y, sine * z))
