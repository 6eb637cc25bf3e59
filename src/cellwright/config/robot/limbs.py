"""Guesses which joints of a robot are its arms, hands, head, waist and lift: a beginning for a configuration file.

An arm is a run of four or more joints without a fork, as near to the root as there is one; what moves behind its end is
its hand. A run that forks into two such runs is a trunk, and they are the arms. Names tell arms from legs, and right
from left; where they say nothing, the side follows from y.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from cellwright.config.robot.config import Arm, Gripper, Posture
from cellwright.config.robot.finger_ends import find_open_ends
from cellwright.config.robot.model import Joint, JointType, RobotModel
from cellwright.config.robot.posture import link_poses
from cellwright.config.robot.sides import mixed_sides, side_of

LEAST_JOINTS = 4
"""Fewest joints of an arm."""
ARM_SHARE = 1 / 3
"""Least length of an arm, as a share of the trunk that it hangs on; a finger is shorter against its arm."""

_LEG = re.compile(r"leg|hip|knee|ankle|foot|toe|thigh|calf|wheel", re.IGNORECASE)
_HEAD = re.compile(r"head|neck|pan|tilt|camera", re.IGNORECASE)
_FINGER = re.compile(r"grip|finger|jaw|claw|knuckle|thumb", re.IGNORECASE)
_TOOL = re.compile(r"(^|_)(ee|tcp|tool0?|tip|grasp\w*|end_?effector)(_|$)", re.IGNORECASE)
_HAND = re.compile(r"hand|palm|flange", re.IGNORECASE)

_BEND = 0.5  # [rad] from the limit that an arm begins at when 0 is next to it


@dataclass(frozen=True, slots=True)
class Limbs:
    """What was found: arms and grippers right before left, the head's joints as (roll, pitch, yaw).

    `is_end_known` says of each gripper whether its kinematics tell at which limits it is open.
    """

    arms: tuple[Arm, ...]
    grippers: tuple[Gripper, ...]
    is_end_known: tuple[bool, ...]
    head: tuple[str | None, str | None, str | None]
    lift: Posture | None
    waist: Posture | None


def find_limbs(robot: RobotModel) -> Limbs:
    """The limbs of a robot, as far as its tree and its names tell."""
    runs = _Runs(robot)
    runs.walk(robot.root)
    limbs = [limb for limb in runs.limbs if not any(_LEG.search(joint.name + joint.child) for joint in limb)]
    limbs.sort(key=lambda limb: _side(robot, limb))
    arms = [[joint for joint in limb if joint not in _trailing(limb)] for limb in limbs]
    hands = [hand for hand in (_hand(robot, arm) for arm in arms) if hand and not mixed_sides(robot, hand)]
    ends = [find_open_ends(robot, _names(hand)) for hand in hands]
    head = _head(robot, [joint for joint in runs.rest if _HEAD.search(joint.name + joint.child)])
    trunk = [
        joint for joint in runs.rest if joint.name not in head and any(joint in _above(robot, arm) for arm in arms)
    ]
    lifts = [joint for joint in trunk if joint.type is JointType.PRISMATIC]
    waist = [joint for joint in trunk if joint not in lifts]
    if {"right", "left"} <= {side_of(joint.name) for joint in waist}:
        waist = [joint for joint in waist if not side_of(joint.name)]
    return Limbs(
        tuple(Arm(_names(arm), _tip(robot, arm), tuple(map(_bent, arm))) for arm in arms),
        tuple(Gripper(_names(hand), each or ()) for hand, each in zip(hands, ends, strict=True)),
        tuple(each is not None for each in ends),
        head,
        Posture(_names(lifts[:1]), (_rest(lifts[0]),)) if lifts else None,
        Posture(_names(waist), tuple(map(_rest, waist))) if waist else None,
    )


class _Runs:
    """Walks from the root to the tips, and gathers joints that follow each other without a fork."""

    def __init__(self, robot: RobotModel) -> None:
        self.limbs: list[list[Joint]] = []
        self.rest: list[Joint] = []
        self._below: dict[str, list[Joint]] = {}
        for joint in robot.joints:
            self._below.setdefault(joint.parent, []).append(joint)
        self._moving: set[str] = set()  # links behind which something moves
        self._counts: dict[str, int] = {}  # most joints of one way behind a link
        self._lengths: dict[str, float] = {}  # length of the longest way behind a link [m]
        for joint in reversed(robot.joints):
            if joint.is_driven or joint.child in self._moving:
                self._moving.add(joint.parent)
            count = self._counts.get(joint.child, 0) + _is_of_an_arm(joint)
            length = self._lengths.get(joint.child, 0.0) + math.dist(joint.origin.position, (0, 0, 0))
            self._counts[joint.parent] = max(count, self._counts.get(joint.parent, 0))
            self._lengths[joint.parent] = max(length, self._lengths.get(joint.parent, 0.0))

    def walk(self, link: str) -> None:
        """Follow every way that leads on from a link."""
        starts = [joint for joint in self._below.get(link, []) if self._leads_on(joint)]
        while starts:
            start = starts.pop(0)
            run, end = self._run(start)
            if len(run) >= LEAST_JOINTS and not self._forks_into_arms(start, end):
                self.limbs.append(run)
            else:
                self.rest += run
                starts += [joint for joint in self._below.get(end, []) if self._leads_on(joint)]

    def _run(self, joint: Joint) -> tuple[list[Joint], str]:
        run: list[Joint] = []
        while True:
            if joint.is_driven and joint.mimic is None:
                run.append(joint)
            ways = [each for each in self._below.get(joint.child, []) if self._leads_on(each)]
            if len(ways) != 1:
                return run, joint.child
            joint = ways[0]

    def _forks_into_arms(self, start: Joint, end: str) -> bool:
        """Whether behind a run, from its first joint to its last link, two arms hang."""
        length = self._lengths.get(start.child, 0.0) - self._lengths.get(end, 0.0)
        while True:
            arms = [
                joint
                for joint in self._below.get(end, [])
                if self._counts.get(joint.child, 0) + _is_of_an_arm(joint) >= LEAST_JOINTS
                and self._lengths.get(joint.child, 0.0) >= ARM_SHARE * length
            ]
            if len(arms) != 1:
                return len(arms) > 1
            end = arms[0].child

    def _leads_on(self, joint: Joint) -> bool:
        return joint.is_driven or joint.child in self._moving


def _is_of_an_arm(joint: Joint) -> bool:
    return joint.is_driven and joint.mimic is None and not _FINGER.search(joint.name + joint.child)


def _trailing(limb: list[Joint]) -> list[Joint]:
    """The joints at the end of a run that are fingers rather than parts of an arm."""
    count = len(limb)
    while count > LEAST_JOINTS and (
        limb[count - 1].type is JointType.PRISMATIC or _FINGER.search(limb[count - 1].name)
    ):
        count -= 1
    return limb[count:]


def _hand(robot: RobotModel, arm: list[Joint]) -> list[Joint]:
    """What opens and closes behind an arm: joints with a range in which 0 is not in the middle."""
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
    """A link that is fixed to the end of an arm and has the name of a tool, else the end itself."""
    fixed = [arm[-1].child]
    fixed += [
        joint.child for joint in robot.joints if joint.type is JointType.FIXED and _is_behind(robot, joint, fixed[0])
    ]
    exact = [link for link in fixed if _TOOL.search(link)]
    named = [link for link in fixed if _HAND.search(link)]
    return (exact or named or fixed)[0]


def _is_behind(robot: RobotModel, joint: Joint, link: str) -> bool:
    """Whether a joint hangs on a link by fixed joints only."""
    while joint.parent != link:
        above = robot.joint_above(joint.parent)
        if above is None or above.type is not JointType.FIXED:
            return False
        joint = above
    return True


def _head(robot: RobotModel, joints: list[Joint]) -> tuple[str | None, str | None, str | None]:
    """The head's roll, pitch and yaw, by the axes about which its joints turn at 0."""
    found: list[str | None] = [None, None, None]
    poses = link_poses(robot, {})
    for joint in joints:
        axis = poses[joint.child].rotate(joint.axis)
        place = max(range(3), key=lambda number: abs(axis[number]))
        if joint.type is JointType.REVOLUTE and abs(axis[place]) > 0.9 and found[place] is None:
            found[place] = joint.name
    return found[0], found[1], found[2]


def _side(robot: RobotModel, limb: list[Joint]) -> tuple[int, float]:
    """What limbs are sorted by: right first, then left; by y [m] where the names do not tell."""
    sides = {side_of(limb[0].name), side_of(limb[-1].name)}
    side = ("right" not in sides) - ("left" not in sides)
    return side, link_poses(robot, {})[limb[-1].child].position[1]


def _above(robot: RobotModel, arm: list[Joint]) -> tuple[Joint, ...]:
    return robot.chain(arm[0].parent)


def _rest(joint: Joint) -> float:
    """Zero, or the limit that lies next to it [rad; m]."""
    return min(max(0.0, joint.limits.lower), joint.limits.upper)


def _bent(joint: Joint) -> float:
    """Zero, or 0.5 rad away from a limit that lies next to it: stretched out, an arm cannot go everywhere [rad]."""
    lower, upper = joint.limits.lower, joint.limits.upper
    near, bend = (upper - lower) / 10, min(_BEND, (upper - lower) / 4)
    if joint.type is not JointType.REVOLUTE or not math.isfinite(near):
        return _rest(joint)
    inside = lower + bend if -lower < near else upper - bend if upper < near else 0.0
    return min(max(round(inside, 3), lower), upper)


def _names(joints: list[Joint]) -> tuple[str, ...]:
    return tuple(joint.name for joint in joints)
