"""Reader of the joint groups of a robot configuration, and of the joints and links that it names."""

import math
from collections.abc import Iterable, Sequence

from cellwright.config.parsing.reader import Keys, Reader
from cellwright.config.parsing.tree import Items, Leaf, Table, YamlNode, describe, shortened
from cellwright.config.robot.config import ArmConfig, GripperConfig, Posture, RangeEnd
from cellwright.config.robot.model import ROOT, Joint, RobotModel
from cellwright.util.errors import did_you_mean

MAX_LISTED = 12
"""Maximum number of valid names in a message; `cellwright robot` lists them all."""

AXES_OF_HEAD = ("roll", "pitch", "yaw")
ARMS = Keys(dict.fromkeys(("joint_index", "ee_index", "rest_j_pos")), {"max_acceleration": None})
GRIPPERS = Keys({"joint_index": None}, dict.fromkeys(("open", "max_acceleration")))
GRIPPER_UNUSED = ("thumb", "index", "middle", "ring", "pinky")
"""Lists of the joints of each finger in old revisions; only `joint_index` was ever read."""
POSTURE = ("joint_index", "rest_j_pos", "max_acceleration")
_NO_HOME = "; write the home positions of the joints [rad; m]"


def numbered(robot: RobotModel, order: str) -> tuple[Joint, ...]:
    """Return the joints of a robot in a file's order: `pybullet` (parents first) or `urdf` (order of elements)."""
    if order == "urdf" and robot.written:
        return tuple(robot.joint(name) for name in robot.written)
    return robot.joints


class GroupReader:
    """Reader of groups and their joints and links; it reports unreadable values and returns None for them.

    The joints of the robot are in the file's order.
    """

    def __init__(self, robot: RobotModel, joints: Sequence[Joint], reader: Reader) -> None:
        self.robot = robot
        self.reader = reader
        self._joints = tuple(joints)
        self._problems = reader.problems
        self.max_accelerations: dict[str, float] = {}
        """Acceleration limits of joints from their groups [rad/s^2; m/s^2]; the lowest of several."""

    def joint(self, node: YamlNode, *, may_mimic: bool = False) -> Joint | None:
        """Return a joint that a program can move, by index or name; with `may_mimic` also one that mimics another."""
        index = self._find(node, "joint", "; -1 marks a missing joint, in the head's list only")
        if index is None:
            return None
        joint = self._joints[index]
        if joint.mimic is not None and not may_mimic:
            self._problems.error(
                node, f"joint {index} ({joint.name}) mimics {joint.mimic.joint}; name {joint.mimic.joint} instead"
            )
            return None
        if joint.is_driven:
            return joint
        movable = listed(each.name for each in self.robot.driven)
        self._problems.error(
            node, f"joint {index} ({joint.name}) is {joint.type} and takes no position (movable: {movable})"
        )
        return None

    def joints(self, node: YamlNode, *, may_mimic: bool = False) -> tuple[Joint, ...] | None:
        """Return a list of distinct joints that a program can move; as `joint` otherwise."""
        if not isinstance(node, Items) or not node.items:
            actual = "an empty list" if isinstance(node, Items) else describe(node)
            self._problems.error(node, f"must be a list of joints, by index or name (got {actual})")
            return None
        found: list[Joint] = []
        for item in node.items:
            joint = self.joint(item, may_mimic=may_mimic)
            if joint is not None and joint in found:
                self._problems.error(item, f"joint {self._joints.index(joint)} ({joint.name}) is in this list twice")
            elif joint is not None:
                found.append(joint)
        return tuple(found) if len(found) == len(node.items) else None

    def link(self, node: YamlNode, *, may_be_root: bool = False) -> str | None:
        """Return a link by index or name."""
        root = self.robot.root
        if isinstance(node, Leaf) and (node.value == root or (may_be_root and _is_missing_joint(node))):
            if may_be_root:
                return root
            self._problems.error(node, f"{root} is the root link, which no joint moves")
            return None
        index = self._find(node, "link", f"; -1 is the root link {root}, which no joint moves")
        return None if index is None else self._joints[index].child

    def _find(self, node: YamlNode, kind: str, root_hint: str) -> int | None:
        """Return the index of a joint or of the link that it moves; None after a report. `root_hint` explains -1."""
        hint = ""
        match node:
            case Leaf(value=bool()):
                pass
            case Leaf(value=float(number)) if number.is_integer():
                hint = f"; did you mean {number:.0f}"
            case Leaf(value=int(index)):
                if 0 <= index < len(self._joints):
                    return index
                self._out_of_range(node, kind, index, root_hint if index == ROOT else "")
                return None
            case Leaf(value=str(name)):
                names = [joint.name if kind == "joint" else joint.child for joint in self._joints]
                if name in names:
                    return names.index(name)
                self._unknown(node, kind, name)
                return None
        self._problems.error(node, f"must be a {kind}, by index or name (got {describe(node)}){hint}")
        return None

    def _unknown(self, node: Leaf, kind: str, name: str) -> None:
        robot, names, hint = self.robot, tuple(self.robot.links), ""
        known = listed(names)
        if kind == "joint":
            names, known = tuple(robot.joint_indices), listed(each.name for each in robot.driven)
            if above := robot.joint_above(name):
                hint = f"; this is a link, moved by joint {above.name}"
        elif name in robot.joint_indices:
            hint = f"; this is a joint, which moves link {robot.joint(name).child}"
        hint = hint or _quoted_index_hint(name) or did_you_mean(name, names)
        self._problems.error(node, f"unknown {kind} {shortened(repr(name))}{hint} (known: {known})")

    def _out_of_range(self, node: Leaf, kind: str, index: int, hint: str) -> None:
        if not self._joints:
            self._problems.error(node, f"there is no {kind} {index}: the robot {self.robot.name} has no joints")
            return
        of_joint = kind == "joint"
        valid = [
            f"{number} {joint.name if of_joint else joint.child}"
            for number, joint in enumerate(self._joints)
            if joint.is_driven or not of_joint
        ]
        self._problems.error(
            node,
            f"{kind} index must be from 0 to {len(self._joints) - 1} (got {shortened(str(index))}{hint}) "
            f"(known: {listed(valid)})",
        )

    def arm(self, node: YamlNode) -> ArmConfig | None:
        """Return an arm."""
        table = self._table(node, ARMS.names)
        if table is None:
            return None
        joints = self._joints_of(table)
        tip_node = self.reader.required(table, "ee_index")
        tip = self.link(tip_node) if tip_node else None
        home = self._home(table, joints)
        self._read_max_acceleration(table, joints)
        if joints is None or tip is None or home is None:
            return None
        return ArmConfig(joint_names(joints), tip, home)

    def gripper(self, node: YamlNode) -> GripperConfig | None:
        """Return a gripper; its joints need limits, between which it opens and closes."""
        table = self._table(node, (*GRIPPERS.names, *GRIPPER_UNUSED))
        joints = self._joints_of(table, may_mimic=True) if table else None
        if table is None or joints is None:
            return None
        if all(joint.mimic is not None for joint in joints):
            self._problems.error(table, "all its joints mimic others; add the joints that they follow")
            return None
        unlimited = [joint.name for joint in joints if not _has_range(joint)]
        if unlimited:
            self._problems.error(
                table.get("joint_index") or table,
                f"joints of a gripper must have limits in the URDF, since it opens and closes between them "
                f"(none for {', '.join(unlimited)})",
            )
            return None
        self._read_max_acceleration(table, joints)
        return GripperConfig(joint_names(joints), self._open_ends(table, len(joints)))

    def _open_ends(self, table: Table, count: int) -> tuple[RangeEnd, ...]:
        """Return the limit at which each joint of a gripper is open; empty if that is the lower one for all."""
        node = table.get("open")
        if node is None:
            return ()
        items = node.items if isinstance(node, Items) else (node,) * count
        ends = [RangeEnd(str(item.value)) for item in items if isinstance(item, Leaf) and item.value in tuple(RangeEnd)]
        if len(items) != count or len(ends) != count:
            choice = " or ".join(RangeEnd)
            actual = f"a list of {len(items)}" if isinstance(node, Items) and len(items) != count else describe(node)
            self._problems.error(node, f"must be {choice}, or a list of {count} of them (got {actual})")
            return ()
        return tuple(ends) if RangeEnd.UPPER in ends else ()

    def posture(self, node: YamlNode, unused: tuple[str, ...] = ()) -> Posture | None:
        """Return the waist: joints and their home; `unused` entries are known too, but not read."""
        table = self._table(node, (*POSTURE, *unused))
        if table is None:
            return None
        joints = self._joints_of(table)
        home = self._home(table, joints)
        self._read_max_acceleration(table, joints)
        return Posture(joint_names(joints), home) if joints is not None and home is not None else None

    def lift(self, node: YamlNode) -> Posture | None:
        """Return the lift of the torso: one joint, with home 0 by default."""
        table = self._table(node, POSTURE)
        joint_node = self.reader.required(table, "joint_index") if table else None
        if table is None or joint_node is None:
            return None
        joint = self.joint(_single_item(joint_node))
        home_node = table.get("rest_j_pos")
        home = self.reader.number(_single_item(home_node)) if home_node else 0.0
        if joint is None or home is None:
            return None
        self._read_max_acceleration(table, (joint,))
        return Posture((joint.name,), (self._within_limits(home_node or table, joint, home),))

    def head(self, node: YamlNode) -> tuple[Posture | None, tuple[int, ...]]:
        """Return the head's joints among roll, pitch and yaw (-1: missing), and their indices in these three."""
        table = self._table(node, POSTURE)
        joints_node = self.reader.required(table, "joint_index") if table else None
        homes_node = self.reader.required(table, "rest_j_pos", _NO_HOME) if table else None
        joint_items = self._triple(joints_node) if joints_node else None
        home_items = self._triple(homes_node) if homes_node else None
        if table is None or joint_items is None or home_items is None:
            return None, ()
        axes = tuple(axis for axis, item in enumerate(joint_items) if not _is_missing_joint(item))
        homes = [self.reader.number(item) for item in home_items]
        present = Items(tuple(joint_items[axis] for axis in axes), table.place, f"{table.key}.joint_index")
        joints = self.joints(present) if axes else ()
        if not joints:
            return None, ()
        self._read_max_acceleration(
            table, [joints[axes.index(axis)] if axis in axes else None for axis in range(len(joint_items))]
        )
        found = [(home_items[axis], joint, homes[axis]) for axis, joint in zip(axes, joints, strict=True)]
        home = [self._within_limits(where, joint, value) for where, joint, value in found if value is not None]
        return (Posture(joint_names(joints), tuple(home)), axes) if len(home) == len(axes) else (None, ())

    def _table(self, node: YamlNode, known: tuple[str, ...]) -> Table | None:
        table = self.reader.table(node)
        if table is not None:
            self.reader.ignored(table, known)
        return table

    def _joints_of(self, table: Table, *, may_mimic: bool = False) -> tuple[Joint, ...] | None:
        node = self.reader.required(table, "joint_index")
        return self.joints(node, may_mimic=may_mimic) if node else None

    def _home(self, table: Table, joints: tuple[Joint, ...] | None) -> tuple[float, ...] | None:
        """Return a position for each joint [rad; m], within its limits."""
        node = self.reader.required(table, "rest_j_pos", _NO_HOME)
        if node is None:
            return None
        if not isinstance(node, Items):
            self._problems.error(node, f"must be a list of positions [rad; m] (got {describe(node)})")
            return None
        positions = [self.reader.number(item) for item in node.items]
        if joints is None:
            return None
        if len(positions) != len(joints):
            counts = f"{len(positions)} for {len(joints)} joint{'' if len(joints) == 1 else 's'}"
            self._problems.error(node, f"must be one position for each joint (got {counts})")
            return None
        found = zip(node.items, joints, positions, strict=True)
        home = [self._within_limits(item, joint, position) for item, joint, position in found if position is not None]
        return tuple(home) if len(home) == len(joints) else None

    def _read_max_acceleration(self, table: Table, joints: Sequence[Joint | None] | None) -> None:
        """Record the acceleration limits of the targets of joints; None is a joint that the robot lacks."""
        node = table.get("max_acceleration")
        if node is None or joints is None:
            return
        items = node.items if isinstance(node, Items) else (node,)
        values = [self.reader.number(item) for item in items]
        if any(value is not None and value <= 0.0 for value in values):
            self._problems.error(node, "must be above 0 [rad/s^2; m/s^2]; leave the entry out for no bound")
        if isinstance(node, Items) and len(values) != len(joints):
            counts = f"{len(values)} for {len(joints)} joint{'' if len(joints) == 1 else 's'}"
            self._problems.error(node, f"must be a number, or a list with one for each joint (got {counts})")
            return
        for joint, value in zip(joints, values if isinstance(node, Items) else values * len(joints), strict=True):
            if joint is not None and joint.mimic is None and value is not None:
                self.max_accelerations[joint.name] = min(value, self.max_accelerations.get(joint.name, math.inf))

    def _within_limits(self, where: YamlNode, joint: Joint, position: float) -> float:
        """Return the position [rad; m] clipped to the limits of a joint."""
        lower, upper = joint.limits.lower, joint.limits.upper
        nearest = min(max(position, lower), upper)
        if nearest != position:
            self._problems.warn(
                where,
                f"must be within the limits of {joint.name}, {lower:g} to {upper:g} (got {position:g}); "
                f"home is {nearest:g}",
            )
        return float(nearest)

    def _triple(self, node: YamlNode) -> tuple[YamlNode, ...] | None:
        if isinstance(node, Items) and len(node.items) == len(AXES_OF_HEAD):
            return node.items
        actual = f"a list of {len(node.items)}" if isinstance(node, Items) else describe(node)
        self._problems.error(node, f"must be a list of three, for roll, pitch and yaw (got {actual})")
        return None


def joint_names(joints: Iterable[Joint]) -> tuple[str, ...]:
    """Return the names of joints."""
    return tuple(joint.name for joint in joints)


def _single_item(node: YamlNode) -> YamlNode:
    """Return the single item of a list of one, or the node itself."""
    return node.items[0] if isinstance(node, Items) and len(node.items) == 1 else node


def _is_missing_joint(node: YamlNode) -> bool:
    return isinstance(node, Leaf) and type(node.value) is int and node.value == ROOT


def _has_range(joint: Joint) -> bool:
    return math.isfinite(joint.limits.lower) and joint.limits.lower < joint.limits.upper < math.inf


def listed(names: Iterable[str]) -> str:
    """Return names for a message, truncated to a maximum number."""
    found = list(names)
    if len(found) > MAX_LISTED:
        found[MAX_LISTED:] = [f"… {len(found) - MAX_LISTED} more, see `cellwright robot`"]
    return ", ".join(found) or "none"


def _quoted_index_hint(name: str) -> str:
    """Return a hint about a number in quotes where an index should be."""
    return f"; write an index without quotes: {name}" if name.isascii() and name.isdigit() and len(name) < 6 else ""
