"""Limbs of a robot that has only a URDF: arms, hands, head and waist, guessed from its tree and its names.

Two fingers are open where they are farther apart, a single one where it is farther from its palm. Hands with more
fingers, and fingers with more than one joint of their own, close in other ways, so their entries stay open.

An arm is the run of four or more joints without a fork that is nearest to the root. The joints behind its end form its
hand. A run that forks into two such runs is a trunk, and they are the arms. Names distinguish arms from legs, and right
from left; without such names, the side follows from y.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from cellwright.config.robot.config import ArmConfig, GripperConfig, Posture, RangeEnd
from cellwright.config.robot.group_reader import joint_names
from cellwright.config.robot.groups import mixed_sides, side_of
from cellwright.config.robot.model import Joint, JointType, RobotModel, link_poses
from cellwright.util.pose import Pose

CLEAR = 0.2
"""Minimum change of the distance, as a share of a finger's travel, that distinguishes the open end from the closed."""

_MIN_MOTION = 1e-6  # [m]; a finger whose centre hardly moves gives no evidence

Vector = NDArray[np.float64]

MIN_ARM_JOINTS = 4
"""Minimum number of joints of an arm."""
ARM_SHARE = 1 / 3
"""Minimum length of an arm, as a share of the trunk that it hangs on; a finger's share of its arm is smaller."""
_LEG = re.compile(r"leg|hip|knee|ankle|foot|toe|thigh|calf|wheel", re.IGNORECASE)
_HEAD = re.compile(r"head|neck|pan|tilt|camera", re.IGNORECASE)
_FINGER = re.compile(r"grip|finger|jaw|claw|knuckle|thumb", re.IGNORECASE)
_TOOL = re.compile(r"(^|_)(ee|tcp|tool0?|tip|grasp\w*|end_?effector)(_|$)", re.IGNORECASE)
_HAND = re.compile(r"hand|palm|flange", re.IGNORECASE)
_TELEOP_TIP = re.compile(r"^io_teleop_ee_link(_|$)")
"""Links that io_teleop's URDFs have for the poses that it commands."""
_BEND = 0.5  # [rad] from the limit: initial position of an arm's joint when its limit is next to 0


@dataclass(frozen=True, slots=True)
class Limbs:
    """Limbs found in a robot: arms and grippers right before left, the head's joints as (roll, pitch, yaw).

    `is_end_known` is True for each gripper whose open limits follow from its kinematics.
    """

    arms: tuple[ArmConfig, ...]
    grippers: tuple[GripperConfig, ...]
    is_end_known: tuple[bool, ...]
    head: tuple[str | None, str | None, str | None]
    lift: Posture | None
    waist: Posture | None


def find_limbs(robot: RobotModel) -> Limbs:
    """Return the limbs of a robot, as far as its tree and its names reveal them."""
    runs = _LimbFinder(robot)
    runs.walk(robot.root)
    limbs = [limb for limb in runs.limbs if not any(_LEG.search(joint.name + joint.child) for joint in limb)]
    limbs.sort(key=lambda limb: _side(robot, limb))
    arms = [[joint for joint in limb if joint not in _finger_joints(limb)] for limb in limbs]
    hands = [hand for hand in (_hand(robot, arm) for arm in arms) if hand and not mixed_sides(robot, hand)]
    ends = [find_open_ends(robot, joint_names(hand)) for hand in hands]
    head = _head(robot, [joint for joint in runs.rest if _HEAD.search(joint.name + joint.child)])
    above = {joint.name for arm in arms for joint in robot.chain(arm[0].parent)}
    trunk = [joint for joint in runs.rest if joint.name not in head and joint.name in above]
    lifts = [joint for joint in trunk if joint.type is JointType.PRISMATIC]
    waist = [joint for joint in trunk if joint not in lifts]
    if {"right", "left"} <= {side_of(joint.name) for joint in waist}:
        waist = [joint for joint in waist if not side_of(joint.name)]
    return Limbs(
        tuple(ArmConfig(joint_names(arm), _tip(robot, arm), tuple(map(_bent_home, arm))) for arm in arms),
        tuple(GripperConfig(joint_names(hand), each or ()) for hand, each in zip(hands, ends, strict=True)),
        tuple(each is not None for each in ends),
        head,
        Posture(joint_names(lifts[:1]), (_nearest_to_zero(lifts[0]),)) if lifts else None,
        Posture(joint_names(waist), tuple(map(_nearest_to_zero, waist))) if waist else None,
    )


class _LimbFinder:
    """Tree walk from the root to the tips that gathers runs of joints without a fork."""

    def __init__(self, robot: RobotModel) -> None:
        self.limbs: list[list[Joint]] = []
        self.rest: list[Joint] = []
        self._below: dict[str, list[Joint]] = {}
        for joint in robot.joints:
            self._below.setdefault(joint.parent, []).append(joint)
        # links behind which there are movable joints
        self._moving: set[str] = set()
        # maximum number of joints on a path behind a link
        self._counts: dict[str, int] = {}
        # length of the longest path behind a link [m]
        self._lengths: dict[str, float] = {}
        for joint in reversed(robot.joints):
            if joint.is_driven or joint.child in self._moving:
                self._moving.add(joint.parent)
            count = self._counts.get(joint.child, 0) + _is_arm_joint(joint)
            length = self._lengths.get(joint.child, 0.0) + math.dist(joint.origin.position, (0, 0, 0))
            self._counts[joint.parent] = max(count, self._counts.get(joint.parent, 0))
            self._lengths[joint.parent] = max(length, self._lengths.get(joint.parent, 0.0))

    def walk(self, link: str) -> None:
        """Follow every path that starts at a link."""
        # Breadth first, since arms hang nearest to the root. A run that forks into two arms is a trunk: its branches
        # are looked at next.
        starts = [joint for joint in self._below.get(link, []) if self._leads_to_joint(joint)]
        while starts:
            start = starts.pop(0)
            run, end = self._run(start)
            if len(run) >= MIN_ARM_JOINTS and not self._forks_into_arms(start, end):
                self.limbs.append(run)
            else:
                self.rest += run
                starts += [joint for joint in self._below.get(end, []) if self._leads_to_joint(joint)]

    def _run(self, joint: Joint) -> tuple[list[Joint], str]:
        run: list[Joint] = []
        while True:
            if joint.is_driven and joint.mimic is None:
                run.append(joint)
            branches = [each for each in self._below.get(joint.child, []) if self._leads_to_joint(each)]
            if len(branches) != 1:
                return run, joint.child
            joint = branches[0]

    def _forks_into_arms(self, start: Joint, end: str) -> bool:
        """Return whether two arms hang behind a run, given its first joint and its last link."""
        length = self._lengths.get(start.child, 0.0) - self._lengths.get(end, 0.0)
        while True:
            arms = [
                joint
                for joint in self._below.get(end, [])
                if self._counts.get(joint.child, 0) + _is_arm_joint(joint) >= MIN_ARM_JOINTS
                and self._lengths.get(joint.child, 0.0) >= ARM_SHARE * length
            ]
            if len(arms) != 1:
                return len(arms) > 1
            end = arms[0].child

    def _leads_to_joint(self, joint: Joint) -> bool:
        return joint.is_driven or joint.child in self._moving


def _is_arm_joint(joint: Joint) -> bool:
    return joint.is_driven and joint.mimic is None and not _FINGER.search(joint.name + joint.child)


def _finger_joints(limb: list[Joint]) -> list[Joint]:
    """Return the joints at the end of a run that are fingers rather than parts of an arm."""
    count = len(limb)
    while count > MIN_ARM_JOINTS and (
        limb[count - 1].type is JointType.PRISMATIC or _FINGER.search(limb[count - 1].name)
    ):
        count -= 1
    return limb[count:]


def _hand(robot: RobotModel, arm: list[Joint]) -> list[Joint]:
    """Return the opening and closing joints behind an arm: those with a range in which 0 is not in the middle."""
    below = {arm[-1].child}
    found: list[Joint] = []
    for joint in robot.joints:
        if joint.parent not in below:
            continue
        below.add(joint.child)
        lower, upper = joint.limits.lower, joint.limits.upper
        closes = math.isfinite(lower) and math.isfinite(upper) and lower < upper and not lower < 0.0 < upper
        if joint.is_driven and closes:
            found.append(joint)
    return found if any(joint.mimic is None for joint in found) else []


def _tip(robot: RobotModel, arm: list[Joint]) -> str:
    """Return the link of io_teleop that is fixed to an arm's end, else one named as a tool, else the end itself."""
    fixed = [arm[-1].child]
    fixed += [
        joint.child for joint in robot.joints if joint.type is JointType.FIXED and _is_behind(robot, joint, fixed[0])
    ]
    matches = ([link for link in fixed if name.search(link)] for name in (_TELEOP_TIP, _TOOL, _HAND))
    return next((found[0] for found in matches if found), fixed[0])


def _is_behind(robot: RobotModel, joint: Joint, link: str) -> bool:
    """Return whether a joint hangs on a link by fixed joints only."""
    while joint.parent != link:
        above = robot.joint_above(joint.parent)
        if above is None or above.type is not JointType.FIXED:
            return False
        joint = above
    return True


def _head(robot: RobotModel, joints: list[Joint]) -> tuple[str | None, str | None, str | None]:
    """Return the head's roll, pitch and yaw, by the axes about which its joints turn at 0."""
    found: list[str | None] = [None, None, None]
    poses = link_poses(robot, {})
    for joint in joints:
        axis = poses[joint.child].rotate(joint.axis)
        place = max(range(3), key=lambda number: abs(axis[number]))
        if joint.type is JointType.REVOLUTE and abs(axis[place]) > 0.9 and found[place] is None:
            found[place] = joint.name
    return found[0], found[1], found[2]


def _side(robot: RobotModel, limb: list[Joint]) -> tuple[int, float]:
    """Return the sort key of limbs: right first, then left; by y [m] if the names have no side."""
    sides = {side_of(limb[0].name), side_of(limb[-1].name)}
    side = ("right" not in sides) - ("left" not in sides)
    return side, link_poses(robot, {})[limb[-1].child].position[1]


def _nearest_to_zero(joint: Joint) -> float:
    """Return zero, or the nearest limit if zero is out of range [rad; m]."""
    return min(max(0.0, joint.limits.lower), joint.limits.upper)


def _bent_home(joint: Joint) -> float:
    """Return zero, or 0.5 rad away from a limit next to it: a stretched arm cannot move in all directions [rad]."""
    lower, upper = joint.limits.lower, joint.limits.upper
    near, bend = (upper - lower) / 10, min(_BEND, (upper - lower) / 4)
    if joint.type is not JointType.REVOLUTE or not math.isfinite(near):
        return _nearest_to_zero(joint)
    inside = lower + bend if -lower < near else upper - bend if upper < near else 0.0
    return min(max(round(inside, 3), lower), upper)


def find_open_ends(robot: RobotModel, names: Sequence[str]) -> tuple[RangeEnd, ...] | None:
    """Return the end of its range at which each joint of a gripper is open; None if the kinematics are ambiguous.

    Joints that mimic another get the end of the joint that they follow.
    """
    joints = [robot.joint(name) for name in names]
    leaders = [joint for joint in joints if joint.mimic is None]
    fingers = _fingers(robot, joints)
    if len(fingers) > 2 or any(sum(joint in leaders for joint in finger) > 1 for finger in fingers):
        return None
    other = fingers[1] if len(fingers) == 2 else None
    found: dict[str, RangeEnd] = {}
    for leader in leaders:
        end = _open_end(robot, leaders, leader, fingers[0], other)
        if end is None:
            return None
        found[leader.name] = end
    return tuple(found[_leader(robot, joint).name] for joint in joints)


def _fingers(robot: RobotModel, joints: Sequence[Joint]) -> list[list[Joint]]:
    """Return the driven joints of each branch that hangs on the palm and has one of a gripper's joints."""
    palms = {joint.parent for joint in joints} - {joint.child for joint in joints}
    behind = {joint.name: robot.chain(joint.child) for joint in robot.driven}
    moved = [joint for joint in robot.driven if joint in joints or _leader(robot, joint) in joints]
    first = [joint for joint in moved if joint.parent in palms]
    return [[joint for joint in robot.driven if each in behind[joint.name]] for each in first]


def _leader(robot: RobotModel, joint: Joint) -> Joint:
    """Return the joint at the head of a mimic chain, or the joint itself."""
    return robot.joint(joint.mimic.joint) if joint.mimic else joint


def _open_end(
    robot: RobotModel, leaders: Sequence[Joint], leader: Joint, finger: Sequence[Joint], other: Sequence[Joint] | None
) -> RangeEnd | None:
    """Return the end at which a finger is farther from the other one, or from the palm, along its path of motion."""
    palm = robot.links[finger[0].parent]
    if other is None and palm.inertial is None and not palm.shapes:
        return None
    own = [joint.child for joint in finger]
    opposite = [palm.name] if other is None else [joint.child for joint in other]
    leaders = [leader, *(joint for joint in leaders if joint is not leader)]
    # offsets with this joint at its lower and then its upper limit, for each place of the rest
    offsets: list[Vector] = []
    for corner in product(*((joint.limits.lower, joint.limits.upper) for joint in reversed(leaders))):
        poses = link_poses(robot, {joint.name: at for joint, at in zip(reversed(leaders), corner, strict=True)})
        offsets.append(_centre(robot, poses, own) - _centre(robot, poses, opposite))
    motion = offsets[1] - offsets[0]
    length = float(np.linalg.norm(motion))
    if length < _MIN_MOTION:
        return None
    along = np.array(offsets) @ motion / length
    min_difference = CLEAR * length
    # fingers cannot pass each other: in that case the centres mislead
    pass_each_other = along.min() < -min_difference and along.max() > min_difference
    lower, upper = np.abs(along[:2])
    if pass_each_other or abs(upper - lower) < min_difference:
        return None
    return RangeEnd.UPPER if upper > lower else RangeEnd.LOWER


def _centre(robot: RobotModel, poses: Mapping[str, Pose], links: Sequence[str]) -> Vector:
    """Return the middle of the links' centres of mass, else of their first shapes, in the root's frame (3) [m]."""
    places = []
    for link in links:
        inertial, shapes = robot.links[link].inertial, robot.links[link].shapes
        link_T_centre = inertial.pose if inertial else shapes[0].pose if shapes else Pose()
        places.append((poses[link] @ link_T_centre).position)
    found: Vector = np.mean(places, axis=0)
    return found
