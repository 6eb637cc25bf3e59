"""The joints of a robot in groups as people think of them: arms, hands, head, waist, lift, legs, and what is left."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from cellwright.config.robot.config import RobotConfig
from cellwright.robot.hands.joints import hand_joints

_SIDES = ("right", "left")
_LEG = re.compile(r"leg|hip|knee|ankle|foot|toe|thigh|calf", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class JointGroup:
    """Joints that belong together.

    Attributes:
        name: for people: `right arm`, `head`.
        kind: `arm`, `hand`, `head`, `waist`, `lift`, `legs` or `other`.
        joints: their names, in the order of the robot.
        side: which of the arms or hands, right 0, left 1; None for what has no side.
    """

    name: str
    kind: str
    joints: tuple[str, ...]
    side: int | None = None


def side_name(place: int, count: int) -> str:
    """What the arm or gripper at a place of a configuration's list is called; empty for one that is alone."""
    if count == 1:
        return ""
    return _SIDES[place] if place < len(_SIDES) else str(place + 1)


def joint_groups(config: RobotConfig, numbers: Mapping[str, int]) -> tuple[JointGroup, ...]:
    """The groups of a robot; each joint is in one, and a group that would be empty is left out.

    Args:
        config: the robot.
        numbers: the joints that can be told where to go, by name, with their place in the robot's order.
    """
    left = set(numbers)
    found = []
    for group in _wanted(config, tuple(numbers)):
        mine = tuple(sorted((name for name in group.joints if name in left), key=lambda name: numbers[name]))
        left.difference_update(mine)
        if mine:
            found.append(JointGroup(group.name, group.kind, mine, group.side))
    return tuple(found)


def _wanted(config: RobotConfig, joints: tuple[str, ...]) -> Iterator[JointGroup]:
    """The groups one after another; a joint goes to the first that names it."""
    for place, arm in enumerate(config.arms):
        yield JointGroup(f"{side_name(place, len(config.arms))} arm".strip(), "arm", arm.joints, place)
    if config.head is not None:
        yield JointGroup("head", "head", config.head.joints)
    if config.waist is not None:
        yield JointGroup("waist", "waist", config.waist.joints)
    if config.dorsal is not None:
        yield JointGroup("lift", "lift", config.dorsal.joints)
    hands = max(len(config.arms), len(config.grippers))
    for place in range(hands):
        hand = hand_joints(config, place) or ()
        yield JointGroup(f"{side_name(place, hands)} hand".strip(), "hand", tuple(hand), place)
    yield JointGroup("legs", "legs", tuple(name for name in joints if _LEG.search(name)))
    yield JointGroup("other joints", "other", joints)
