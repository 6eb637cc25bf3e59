"""Which links of a robot may touch each other.

Links that a joint joins never do: their shapes overlap there by design. Links that are fixed to each other count as
one. And pairs whose shapes overlap in the posture that the robot is put up in are left out as well: they would push
each other apart for ever, and where they overlap then, it is the shapes that are too large.
"""

from __future__ import annotations

from itertools import combinations, product
from typing import Any

import mujoco

from cellwright.config.robot.model import RobotModel

Pair = tuple[str, str]


def joined_pairs(robot: RobotModel, moved: frozenset[str], touched: frozenset[str]) -> list[Pair]:
    """Pairs of links that are joined, by one joint that moves or by any number that do not.

    Args:
        robot: the robot.
        moved: the joints that move in the engine.
        touched: links with shapes that are touched: others need no pair.
    """
    group_of = {robot.root: 0}
    groups: list[list[str]] = [[robot.root]]
    neighbours: list[tuple[int, int]] = []
    for joint in robot.joints:
        parent = group_of[joint.parent]
        if joint.name in moved:
            neighbours.append((parent, len(groups)))
            group_of[joint.child] = len(groups)
            groups.append([joint.child])
        else:
            group_of[joint.child] = parent
            groups[parent].append(joint.child)
    solid = [[link for link in group if link in touched] for group in groups]
    inside = [pair for group in solid for pair in combinations(group, 2)]
    return inside + [pair for one, other in neighbours for pair in product(solid[one], solid[other])]


def overlapping_pairs(model: mujoco.MjModel, data: mujoco.MjData) -> list[Pair]:
    """Pairs of bodies that reach into each other in the posture of `data`, each once."""
    mujoco.mj_fwdPosition(model, data)
    found = {
        (min(bodies), max(bodies))
        for contact in data.contact[: data.ncon]
        if contact.dist < 0 and (bodies := [int(model.geom_bodyid[geom]) for geom in contact.geom])
    }
    return [(model.body(one).name, model.body(other).name) for one, other in sorted(found)]


def exclude(spec: Any, pairs: list[Pair]) -> None:
    """Keep pairs of bodies from touching each other."""
    for one, other in pairs:
        spec.add_exclude(bodyname1=one, bodyname2=other)
