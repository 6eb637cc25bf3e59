"""Reader of the robots of a cell: their entries, and the configuration that each names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from cellwright.config.layout.arm_reader import find_model
from cellwright.config.layout.robots import MAX_ROBOTS, NAMESPACE, CellRobot, Hand, robot_links
from cellwright.config.layout.values import Named, turned
from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Problem
from cellwright.util.errors import DescriptionError, did_you_mean
from cellwright.util.pose import Vector3

if TYPE_CHECKING:
    from cellwright.config.robot.config import RobotConfig

_REACH = 0.06
"""Default distance [m] from the grasp point of a hand to a part that it can hold."""
_AROUND = 0.1
"""Distance [m] that a link reaches beyond its origin, as for a view."""
_SIDES = ("right", "left")
_TAKEN = (
    *("ariac", "cellwright", "controller_manager", "gazebo", "clock", "tf", "tf_static"),
    *("robot_description", "use_sim_time"),
)
"""Namespaces of the cell's own topics and parameters."""


def read_robots(found: Sequence[Named], reader: Reader) -> tuple[tuple[CellRobot, ...], dict[str, RobotConfig]]:
    """Return the robots, and the configuration of each by name; those with errors are left out."""
    if len(found) > MAX_ROBOTS:
        reader.problems.error(found[MAX_ROBOTS].entry, f"a cell has at most {MAX_ROBOTS} robots (got {len(found)})")
    robots: dict[str, CellRobot] = {}
    configs = {}
    for each in found:
        values, entries = each.values, each.table.entries
        namespace = values.get("namespace", NAMESPACE)
        owner = next((other.name for other in robots.values() if other.namespace == namespace), None)
        if owner is not None:
            message = f"{owner} has the namespace {namespace!r}; give each robot its own: namespace: {each.name}"
            reader.problems.error(entries.get("namespace", each.entry), message)
            continue
        if namespace in _TAKEN:
            reader.problems.error(entries["namespace"], f"the cell has the name /{namespace}; choose another")
            continue
        config = _config(each, reader)
        if config is not None:
            pose = turned(values["at"], values.get("turn", 0.0))
            hands = _hands(each, config, reader) if "hands" in values else ()
            robot = CellRobot(each.name, values["model"], pose, namespace, hands)
            robots[each.name] = replace(robot, box=_box(robot, config))
            configs[each.name] = config
    return tuple(robots.values()), configs


def _hands(each: Named, config: RobotConfig, reader: Reader) -> tuple[Hand, ...]:
    """Return a hand for each arm with a gripper; report it if there is none."""
    reach = each.values["hands"].get("reach", _REACH)
    links = config.command_links or tuple(arm.tip for arm in config.arms)
    hands = tuple(
        Hand(f"{each.name}/{_SIDES[side] if side < len(_SIDES) else side}", side, link, reach)
        for side, (link, _) in enumerate(zip(links, config.grippers, strict=False))
    )
    if not hands:
        message = f"{config.name} has no arm with a gripper in its configuration; leave out hands"
        reader.problems.error(each.table.entries["hands"], message)
    return hands


def _box(robot: CellRobot, config: RobotConfig) -> tuple[Vector3, Vector3]:
    """Return the corners of the box around the links of a robot, in the frame of its pose."""
    here = robot.pose.inverse()
    places = ((here @ pose).position for pose in robot_links(robot, config).values())
    (x0, x1), (y0, y1), (z0, z1) = ((min(each) - _AROUND, max(each) + _AROUND) for each in zip(*places, strict=True))
    return (x0, y0, z0), (x1, y1, z1)


def _config(each: Named, reader: Reader) -> RobotConfig | None:
    """Return the configuration of a robot; None after errors."""
    # most cells have no robot of their own
    from cellwright.config.robot.robots import bundled, load_robot

    name, entry = str(each.values["model"]), each.table.entries["model"]
    if name in bundled():
        path = None
    elif "/" not in name and "." not in name:
        message = f"unknown robot {name!r}{did_you_mean(name, bundled())}, or name a file: model: my_robot.urdf"
        reader.problems.error(entry, message)
        return None
    else:
        path = find_model(name, entry.value, reader)
        if path is None:
            return None
    try:
        return load_robot(path or name, lambda line: reader.problems.warn(entry, line))
    except DescriptionError as error:
        for problem in error.problems:
            if isinstance(problem, Problem):
                reader.problems.add(problem)
        return None
