"""Right and left: which side a name tells, and groups of joints that mix both."""

from __future__ import annotations

import re
from collections.abc import Sequence

from cellwright.config.robot.model import Joint, RobotModel

MIN_NAMED_JOINTS, MIN_JOINTS = 2, 3
"""Joints between a fork and a group's joints that make the branch a limb rather than a finger, with and without names
that tell the sides: one joint may be that which spreads a finger."""

_SIDE = re.compile(
    r"(?:^|[_\W])(?P<r>r(?:ight)?)(?=[_\W\d]|$)|(?:^|[_\W])(?P<l>l(?:eft)?)(?=[_\W\d]|$)|(?P<right>right)|(?P<left>left)",
    re.IGNORECASE,
)


def side_of(name: str) -> str:
    """Side that a name tells first: "right", "left", or "" for none; `right_gripper_left_finger` is on the right."""
    match = _SIDE.search(name)
    if match is None:
        return ""
    return "right" if match["r"] or match["right"] else "left"


def mixed_sides(robot: RobotModel, joints: Sequence[Joint]) -> str:
    """Reason why a group of joints belongs to both sides of a robot; empty if it belongs to one.

    Two fingers of one palm may be called left and right. So names count only where a limb stands between the fork and
    the group, and without names it takes two such limbs.
    """
    ways = [robot.chain(joint.child) for joint in joints]
    shared = _shared_length(ways)
    names = {joint.name for joint in joints}
    between: dict[str, int] = {}
    for way in ways:
        own = way[shared:]
        count = sum(joint.is_driven and joint.mimic is None and joint.name not in names for joint in own)
        if own:
            between[own[0].name] = max(count, between.get(own[0].name, 0))
    by_side = {side_of(joint.name): joint.name for joint in joints}
    if "right" in by_side and "left" in by_side and max(between.values(), default=0) >= MIN_NAMED_JOINTS:
        return f"{by_side['right']} is on the right, {by_side['left']} on the left"
    branches = [name for name, count in between.items() if count >= MIN_JOINTS]
    return f"its joints hang on two limbs, behind {branches[0]} and behind {branches[1]}" if len(branches) > 1 else ""


def _shared_length(ways: Sequence[tuple[Joint, ...]]) -> int:
    """Number of joints that all ways from the root begin with."""
    count = 0
    for each in zip(*ways, strict=False):
        if any(joint is not each[0] for joint in each):
            break
        count += 1
    return count
