"""Reads where a robot stands: `base_pose`, with a quaternion (x, y, z, w) as messages have it."""

from __future__ import annotations

import math

from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Items, Node, described
from cellwright.config.robot import config_keys
from cellwright.util.pose import Pose, normalized

_ROUGH = 0.01  # how far from 1 the length of a quaternion may be before somebody should look: 0.707 is rounding


def read_base_pose(node: Node | None, reader: Reader) -> Pose:
    """The pose [m], its quaternion scaled to unit length; the identity where nothing is said."""
    table = reader.table(node) if node else None
    if table is None:
        return Pose()
    reader.ignored(table, config_keys.BASE_POSE)
    position_node, orientation_node = table.get("position"), table.get("orientation")
    position = _numbers(position_node, 3, "x, y, z [m]", reader) if position_node else (0.0, 0.0, 0.0)
    orientation = _numbers(orientation_node, 4, "x, y, z, w", reader) if orientation_node else (0.0, 0.0, 0.0, 1.0)
    if position is None or orientation is None:
        return Pose()
    reader.near(position_node or table, position)
    x, y, z, w = orientation
    length = math.hypot(x, y, z, w)
    where = orientation_node or table
    if not 1e-6 < length < 1e6:
        reader.problems.error(
            where, f"must be a quaternion x, y, z, w, and this one turns nowhere: its length is {length:g}"
        )
        return Pose()
    if abs(length - 1.0) > _ROUGH:
        reader.problems.warn(where, f"a quaternion has the length 1, and this one {length:.3g}; it is scaled")
    return Pose((position[0], position[1], position[2]), normalized((w, x, y, z)))


def _numbers(node: Node, count: int, what: str, reader: Reader) -> tuple[float, ...] | None:
    if not isinstance(node, Items) or len(node.items) != count:
        found = f"one of {len(node.items)}" if isinstance(node, Items) else described(node)
        reader.problems.error(node, f"must be a list of {count} numbers, {what}, not {found}")
        return None
    numbers = [reader.number(item) for item in node.items]
    return tuple(float(number) for number in numbers if number is not None) if None not in numbers else None
