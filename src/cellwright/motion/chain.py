"""Chain of an arm: its joints as axes in the frame of its base, its links, and the motion of its tool.

The axes are those of the arm with all joints at 0. So a chain is the same whatever file it comes from, and whichever
frames that file gives to the links between. The pose of a link is the product of the motions about the axes before it
(the product of exponentials of Brockett), and its pose at 0.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cellwright.config.robot.model import JointType, RobotModel, link_poses
from cellwright.motion.solver import TURN_WEIGHT, Margins, Vector
from cellwright.util.errors import UnknownNameError, UsageError
from cellwright.util.pose import Pose, Vector3


@dataclass(frozen=True, slots=True)
class ChainJoint:
    """A joint of a chain, by its axis in the frame of the base with all joints at 0.

    Attributes:
        name: name of the joint.
        axis: direction of the axis, a unit vector.
        point: a point of the axis [m].
        is_prismatic: True if it moves along the axis, and not about it.
        lower, upper: limits of position [rad; m]; infinite without.
        speed: maximum speed [rad/s; m/s]; infinite without.
    """

    name: str
    axis: Vector3
    point: Vector3
    is_prismatic: bool = False
    lower: float = -math.inf
    upper: float = math.inf
    speed: float = math.inf


@dataclass(frozen=True, slots=True)
class ChainLink:
    """A link that a chain carries: the number of joints between it and the base, and base_T_link [m] with them at 0."""

    joints: int
    pose: Pose


@dataclass(frozen=True)
class Chain:
    """An arm as a chain of joints from its base to its tool.

    Attributes:
        joints: the joints, base first.
        base_T_tool: pose of the tool with all joints at 0 [m].
        links: links that move with the chain, by name.

    Raises:
        UsageError: there is no joint.

    Example:
        >>> elbow = ChainJoint("elbow", (0.0, 0.0, 1.0), (0.5, 0.0, 0.0))
        >>> arm = Chain((ChainJoint("shoulder", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)), elbow), Pose((1.0, 0.0, 0.0)))
        >>> tuple(round(each, 9) for each in arm.tool((0.0, math.pi / 2)).position)
        (0.5, 0.5, 0.0)
    """

    joints: tuple[ChainJoint, ...]
    base_T_tool: Pose
    links: Mapping[str, ChainLink] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.joints:
            raise UsageError("arm: no joint moves its tool (got 0 joints); choose a tip behind a driven joint")

    @property
    def reach(self) -> float:
        """Upper bound of the distance of the tool from the axis of the first joint [m]."""
        points = [*(joint.point for joint in self.joints), self.base_T_tool.position]
        lengths = (math.dist(one, other) for one, other in pairwise(points))
        slides = (max(abs(joint.lower), abs(joint.upper)) for joint in self.joints if joint.is_prismatic)
        return sum(lengths) + sum(slides)

    def tool(self, q: Sequence[float]) -> Pose:
        """Return base_T_tool [m] at joint positions [rad; m]."""
        return self._motions(q)[-1] @ self.base_T_tool

    def link_poses(self, q: Sequence[float]) -> dict[str, Pose]:
        """Return base_T_link of each link [m] at joint positions [rad; m], by name."""
        motions = self._motions(q)
        return {name: motions[link.joints] @ link.pose for name, link in self.links.items()}

    def jacobian(self, q: Sequence[float]) -> NDArray[np.float64]:
        """Return the Jacobian of the tool, shape (6, joints): its velocity along and about the axes of the base.

        The first three rows are in m/rad (m/m of a prismatic joint), the others in rad/rad.
        """
        motions = self._motions(q)
        tx, ty, tz = (motions[-1] @ self.base_T_tool).position
        columns: list[tuple[float, ...]] = []
        for joint, motion in zip(self.joints, motions, strict=False):
            x, y, z = motion.rotate(joint.axis)
            if joint.is_prismatic:
                columns.append((x, y, z, 0.0, 0.0, 0.0))
            else:
                # the velocity of the tool is the product of axis and lever; numpy's takes five times as long
                px, py, pz = motion.transform(joint.point)
                lx, ly, lz = tx - px, ty - py, tz - pz
                columns.append((y * lz - z * ly, z * lx - x * lz, x * ly - y * lx, x, y, z))
        return np.array(columns).T

    def margin(self, q: Sequence[float]) -> Margins:
        """Return the distances of a posture from singularities and limits."""
        weighted = np.repeat((1.0, TURN_WEIGHT), 3)[:, None] * self.jacobian(q)
        limits = (min(value - joint.lower, joint.upper - value) for value, joint in zip(q, self.joints, strict=True))
        return Margins(float(np.linalg.svd(weighted, compute_uv=False)[-1]), min(limits))

    def _motions(self, q: Sequence[float]) -> list[Pose]:
        """Return the motions of the arm behind each number of joints from 0 on, from where it is with all at 0."""
        motion = Pose()
        result = [motion]
        for joint, value in zip(self.joints, q, strict=True):
            x, y, z = joint.axis
            if joint.is_prismatic:
                own = Pose((x * value, y * value, z * value))
            else:
                sine = math.sin(value / 2)
                turn = Pose(quaternion=(math.cos(value / 2), sine * x, sine * y, sine * z))
                px, py, pz = joint.point
                tx, ty, tz = turn.rotate(joint.point)
                own = Pose((px - tx, py - ty, pz - tz), turn.quaternion)
            motion = motion @ own
            result.append(motion)
        return result


class ChainArm:
    """The parts of a solver that are the same for every chain: joints, limits, links and margins.

    Args:
        chain: the arm.
        home: its home posture [rad; m].

    Raises:
        UsageError: home has another number of positions than the chain has joints.
    """

    def __init__(self, chain: Chain, home: Sequence[float]) -> None:
        if len(home) != len(chain.joints):
            raise UsageError(f"home: it must have {len(chain.joints)} positions (got {len(home)}); give one a joint")
        self.chain = chain
        self.joints = tuple(joint.name for joint in chain.joints)
        self.lower: Vector = tuple(joint.lower for joint in chain.joints)
        self.upper: Vector = tuple(joint.upper for joint in chain.joints)
        self.speed: Vector = tuple(joint.speed for joint in chain.joints)
        self.home: Vector = tuple(float(each) for each in home)

    def links(self, q: Sequence[float]) -> Mapping[str, Pose]:
        """Return base_T_link of all links that the arm carries [m], by name; limits are ignored."""
        return self.chain.link_poses(q)

    def margin(self, q: Sequence[float]) -> Margins:
        """Return the distances of a posture from singularities and limits."""
        return self.chain.margin(q)


def chain_of(robot: RobotModel, tip: str, *, base: str | None = None, tip_T_tool: Pose | None = None) -> Chain:
    """Return the chain of a robot from one link to another.

    Joints beside the chain, such as those of fingers, are at 0. With `base` behind a rail, the chain is the arm alone.

    Args:
        robot: the robot.
        tip: link at the end of the chain.
        base: link whose frame is that of the base; the root by default.
        tip_T_tool: pose of the tool in the frame of the tip [m]; the tip itself by default.

    Raises:
        UnknownNameError: there is no such link.
        UsageError: the tip is not behind the base, no joint is between them, or one that no program drives.
    """
    base = robot.root if base is None else base
    for name in (base, tip):
        if name not in robot.links:
            raise UnknownNameError("link", name, robot.links)
    path = robot.chain(tip)
    if base != robot.root:
        names = [joint.child for joint in path]
        if base not in names:
            raise UsageError(f"{robot.name}: tip must be behind base (got {tip}, {base}); exchange them")
        path = path[names.index(base) + 1 :]
    root_T = link_poses(robot, {})
    base_T = {name: root_T[base].relative(pose) for name, pose in root_T.items()}
    joints: list[ChainJoint] = []
    for joint in path:
        if joint.type is JointType.FIXED:
            continue
        if not joint.is_driven or joint.mimic is not None:
            kind = joint.type if joint.mimic is None else f"mimics {joint.mimic.joint}"
            raise UsageError(
                f"{robot.name}: joint {joint.name}: each joint of an arm must be driven on its own (got {kind}); "
                "choose another tip"
            )
        pose, limits = base_T[joint.child], joint.limits
        is_bounded = joint.type is not JointType.CONTINUOUS
        joints.append(
            ChainJoint(
                joint.name,
                pose.rotate(joint.axis),
                pose.position,
                is_prismatic=joint.type is JointType.PRISMATIC,
                lower=limits.lower if is_bounded else -math.inf,
                upper=limits.upper if is_bounded else math.inf,
                speed=limits.velocity,
            )
        )
    return Chain(tuple(joints), base_T[tip] @ (tip_T_tool or Pose()), _carried(robot, base, joints, base_T))


def _carried(
    robot: RobotModel, base: str, joints: Sequence[ChainJoint], base_T: Mapping[str, Pose]
) -> dict[str, ChainLink]:
    """Return the links behind the base, with the number of joints of the chain that move each."""
    names = {joint.name for joint in joints}
    counts = {base: 0}
    for joint in robot.joints:
        if joint.parent in counts:
            counts[joint.child] = counts[joint.parent] + (joint.name in names)
    return {name: ChainLink(count, base_T[name]) for name, count in counts.items()}
