"""Finds the joints and links that a robot configuration means, which it gives by index or by name."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from cellwright.config.parsing.problems import Problems
from cellwright.config.parsing.tree import Items, Leaf, Node, described, shortened
from cellwright.config.robot.model import ROOT, Joint, RobotModel
from cellwright.util.errors import did_you_mean

MOST_LISTED = 12
"""Most valid names in a message; `cellwright robot` lists them all."""


def numbered(robot: RobotModel, order: str) -> tuple[Joint, ...]:
    """The joints of a robot as a file counts them: `pybullet` (parents first) or `urdf` (as their elements stand)."""
    if order == "urdf" and robot.written:
        return tuple(robot.joint(name) for name in robot.written)
    return robot.joints


class References:
    """Turns indices and names into joints and links, and reports what stands for none.

    Args:
        robot: the robot.
        joints: its joints as the file counts them.
        problems: takes what is wrong.
    """

    def __init__(self, robot: RobotModel, joints: Sequence[Joint], problems: Problems) -> None:
        self.robot = robot
        self._joints = tuple(joints)
        self._problems = problems

    def joint(self, node: Node, *, may_follow: bool = False) -> Joint | None:
        """A joint that a program can move, or None after a report.

        Args:
            node: its index or name.
            may_follow: whether it may be one that mimics another.
        """
        joint = self._joint(node)
        if joint is None:
            return None
        index = self._joints.index(joint)
        if joint.mimic is not None and not may_follow:
            self._problems.error(node, f"joint {index} ({joint.name}) mimics {joint.mimic.joint}; name that one")
            return None
        if joint.is_driven:
            return joint
        movable = listed(each.name for each in self.robot.driven)
        self._problems.error(
            node,
            f"joint {index} ({joint.name}) is {joint.type}: no position can be commanded; those that move: {movable}",
        )
        return None

    def joints(self, node: Node, *, may_follow: bool = False) -> tuple[Joint, ...] | None:
        """A list of joints that a program can move, each once, or None after a report; as `joint` otherwise."""
        if not isinstance(node, Items) or not node.items:
            what = "an empty list" if isinstance(node, Items) else described(node)
            self._problems.error(node, f"must be a list of joints, by index or name, not {what}")
            return None
        found: list[Joint] = []
        for item in node.items:
            joint = self.joint(item, may_follow=may_follow)
            if joint is not None and joint in found:
                self._problems.error(
                    item, f"joint {self._joints.index(joint)} ({joint.name}) stands in this list twice"
                )
            elif joint is not None:
                found.append(joint)
        return tuple(found) if len(found) == len(node.items) else None

    def link(self, node: Node, *, may_be_root: bool = False) -> str | None:
        """A link by index or name, or None after a report."""
        match node:
            case Leaf(value=bool()):
                pass
            case Leaf(value=int(index)):
                if index == ROOT and may_be_root:
                    return self.robot.root
                if 0 <= index < len(self._joints):
                    return self._joints[index].child
                root = f" (-1 is the root link {self.robot.root}, which nothing moves)" if index == ROOT else ""
                self._out_of_range(node, "link", index, root)
                return None
            case Leaf(value=str(name)):
                return self._named_link(node, name, may_be_root=may_be_root)
        self._problems.error(node, f"must be a link, by index or name, not {described(node)}{_whole(node)}")
        return None

    def _joint(self, node: Node) -> Joint | None:
        match node:
            case Leaf(value=bool()):
                pass
            case Leaf(value=int(index)):
                if 0 <= index < len(self._joints):
                    return self._joints[index]
                absent = " (-1 is for what the robot lacks, in the head's list only)" if index == ROOT else ""
                self._out_of_range(node, "joint", index, absent)
                return None
            case Leaf(value=str(name)):
                return self._named_joint(node, name)
        self._problems.error(node, f"must be a joint, by index or name, not {described(node)}{_whole(node)}")
        return None

    def _named_joint(self, node: Leaf, name: str) -> Joint | None:
        if name in self.robot.joint_indices:
            return self.robot.joint(name)
        above = self.robot.joint_above(name)
        hint = f"; it is a link, and the joint that moves it is {above.name}" if above else ""
        hint = hint or _in_quotes(name) or did_you_mean(name, self.robot.joint_indices)
        known = listed(each.name for each in self.robot.driven)
        self._problems.error(node, f"unknown joint {shortened(repr(name))}{hint} (known: {known})")
        return None

    def _named_link(self, node: Leaf, name: str, *, may_be_root: bool) -> str | None:
        if name == self.robot.root and not may_be_root:
            self._problems.error(node, f"{name} is the root link, which nothing moves")
            return None
        if name in self.robot.links:
            return name
        hint = _in_quotes(name) or did_you_mean(name, self.robot.links)
        if name in self.robot.joint_indices:
            hint = f"; it is a joint, and the link that it moves is {self.robot.joint(name).child}"
        self._problems.error(node, f"unknown link {shortened(repr(name))}{hint} (known: {listed(self.robot.links)})")
        return None

    def _out_of_range(self, node: Leaf, kind: str, index: int, remark: str) -> None:
        if not self._joints:
            self._problems.error(node, f"there is no {kind} {index}: the robot {self.robot.name} has no joints")
            return
        if kind == "joint":
            valid = [f"{number} {joint.name}" for number, joint in enumerate(self._joints) if joint.is_driven]
        else:
            valid = [f"{number} {joint.child}" for number, joint in enumerate(self._joints)]
        self._problems.error(
            node,
            f"there is no {kind} {shortened(str(index))}{remark}; indices go from 0 to {len(self._joints) - 1} "
            f"(known: {listed(valid)})",
        )


def listed(names: Iterable[str]) -> str:
    """Names for a message, cut where they would flood it."""
    found = list(names)
    if len(found) > MOST_LISTED:
        found[MOST_LISTED:] = [f"… {len(found) - MOST_LISTED} more, see `cellwright robot`"]
    return ", ".join(found) or "none"


def _whole(node: Node) -> str:
    """A remark on a number with a point where an index should be."""
    if isinstance(node, Leaf) and isinstance(node.value, float) and node.value.is_integer():
        return f"; did you mean {node.value:.0f}"
    return ""


def _in_quotes(name: str) -> str:
    """A remark on a number in quotes where an index should be."""
    return f"; an index stands without quotes: {name}" if name.isascii() and name.isdigit() and len(name) < 6 else ""
