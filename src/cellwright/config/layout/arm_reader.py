"""Reader of the arms of a cell: their entries, and the robot's description that each names."""

from __future__ import annotations

import importlib.util
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from cellwright.config.gripper_links import GripperNames
from cellwright.config.layout.arm_models import ArmModel, bare_arm, mount_pose
from cellwright.config.layout.arms import MAX_ARMS, Arm, Mount, MountKind, OnLink, original_mount
from cellwright.config.layout.values import Named, turned
from cellwright.config.models.files import FileReference
from cellwright.config.parsing.reader import Read, Reader
from cellwright.config.parsing.schema import accepts, schema_of
from cellwright.config.parsing.tree import Entry, Located, Problem, Table, YamlNode
from cellwright.config.robot.cell_needs import missing_for_cell
from cellwright.config.robot.collision_shapes import CollisionShapes
from cellwright.config.robot.given_drives import GivenDrive, given_drives
from cellwright.config.robot.model import RobotModel
from cellwright.config.robot.urdf_file import package_folders
from cellwright.config.ur10 import UR10
from cellwright.util.errors import DescriptionError, UsageError, did_you_mean
from cellwright.util.pose import Pose

_HEIGHTS: Mapping[MountKind, float] = {"rail": 0.9, "pedestal": 0.5, "table": 0.7, "floor": 0.0, "link": 0.0}
"""Default height of each mount [m]."""
_OF_OTHERS = ("tip", "tool", "limits", "drives", "bandwidth", "collision")
"""Entries that an arm with a model of its own has; those of 2017's arm are fixed."""


def read_arms(
    found: Sequence[Named], reader: Reader, robots: Mapping[str, Mapping[str, Pose]]
) -> tuple[tuple[Arm, ...], dict[str, ArmModel]]:
    """Return the arms, and the models of those that have their own, by name; those with errors are left out.

    Args:
        found: their entries.
        reader: receives every mistake.
        robots: poses of the links of robots in the world, on which arms may stand.
    """
    if len(found) > MAX_ARMS:
        reader.problems.error(found[MAX_ARMS].entry, f"a cell has at most {MAX_ARMS} arms (got {len(found)})")
    arms, models, owners = list[Arm](), dict[str, ArmModel](), dict[str, str]()
    for each in found:
        values = dict(each.values)
        mount: Mount = values["mount"]
        arm: Arm | None = None
        if "model" in values:
            if (read := _own(each, reader)) is not None:
                arm, models[each.name] = read
        elif _is_original(each, mount, reader):
            arm = Arm(each.name, original_mount(mount.pose), home=values.get("home", {}))
            _check_home(arm, UR10, each.table, reader)
        if arm is None or (arm := _placed(arm, arms, models, robots, (each.table, reader))) is None:
            continue
        namespace = values.get("namespace", each.name if len(found) > 1 else "")
        if (owner := owners.setdefault(namespace, each.name)) != each.name:
            reader.problems.error(each.table.entries.get("namespace", each.entry), f"{owner} has this namespace")
        arms.append(replace(arm, namespace=namespace, names=values.get("names", arm.names)))
    return tuple(arms), models


def mounted(kind: MountKind, at: tuple[float, ...], turn: float = 0.0, **more: Any) -> Mount:
    """Return the mount of an arm, at the usual height of its kind if none is given."""
    height = at[2] if len(at) == 3 else _HEIGHTS[kind]
    pose = turned((at[0], at[1], height), turn)
    arm, robot, link = (more.pop(name, "") for name in ("arm", "robot", "link"))
    return Mount(kind, pose, **more, on=OnLink(arm, robot, link, pose) if arm or robot or link else None)


def _placed(
    arm: Arm,
    others: Sequence[Arm],
    models: Mapping[str, ArmModel],
    robots: Mapping[str, Mapping[str, Pose]],
    at: tuple[Table, Reader],
) -> Arm | None:
    """Return an arm whose mount is in the world; `others` are those above it. None after errors."""
    on, kind, (table, reader) = arm.mount.on, arm.mount.kind, at
    fault = ""
    if kind != "link":
        fault = "" if on is None else f"a mount of kind {kind} has no arm, robot or link; use kind: link"
    elif on is None or not on.link or bool(on.arm) == bool(on.robot):
        fault = "a mount of kind link names the arm or the robot that carries this one, and its link"
    else:
        fault = _link_fault(on, others, models, robots)
    if fault:
        reader.problems.error(table.entries["mount"], fault)
        return None
    return replace(arm, mount=replace(arm.mount, pose=mount_pose(arm, others, models, robots=robots)))


def _link_fault(
    on: OnLink, arms: Sequence[Arm], models: Mapping[str, ArmModel], robots: Mapping[str, Mapping[str, Pose]]
) -> str:
    """Return what is wrong with the place of an arm on a link; empty if nothing is."""
    links: Collection[str]
    if on.robot:
        if on.robot not in robots:
            return f"there is no robot {on.robot!r}{did_you_mean(on.robot, robots)}"
        links = robots[on.robot]
    else:
        carrier = next((each for each in arms if each.name == on.arm), None)
        if carrier is None:
            hint = did_you_mean(on.arm, [each.name for each in arms]) or "; an arm that carries another comes before it"
            return f"there is no arm {on.arm!r} above{hint}"
        if carrier.is_original:
            return f"{on.arm} is the arm of 2017, which carries no other; give it a model"
        links = bare_arm(carrier, models[carrier.name], "").links
    return "" if on.link in links else f"{on.carrier} has no link {on.link!r}{did_you_mean(on.link, links)}"


def by_name(each: Read) -> Read:
    """Return a reader of a mapping of names, such as joints, to values of one kind."""

    @accepts(lambda: {"type": "object", "additionalProperties": schema_of(each)})
    def read(reader: Reader, node: YamlNode) -> dict[str, Any] | None:
        table = reader.table(node)
        if table is None:
            return None
        found = {str(entry.name): each(reader, entry.value) for entry in table.entries.values()}
        return {name: value for name, value in found.items() if value is not None}

    return read


def _is_original(each: Named, mount: Mount, reader: Reader) -> bool:
    """Return whether an entry without a model describes the arm of 2017; report it if it does not."""
    own = next((each.table.entries[name] for name in _OF_OTHERS if name in each.table.entries), None)
    plain = Mount("rail", mount.pose)
    if own is None and mount == plain:
        return True
    where: Located = own or each.table.entries["mount"]
    what = f"{own.name!s} needs a model" if own else "without a model the arm is a UR10 on the rail of 2017"
    reader.problems.error(where, f"{what}; name the file of a robot: model: my_arm.urdf")
    return False


def _own(each: Named, reader: Reader) -> tuple[Arm, ArmModel] | None:
    """Return an arm with a model of its own; None after errors."""
    values, entries = each.values, each.table.entries
    path = find_model(str(values["model"]), entries["model"].value, reader)
    if path is None:
        return None
    # most cells have no robot of their own
    from cellwright.config.robot.robots import load_robot

    try:
        config = load_robot(path, lambda line: reader.problems.warn(entries["model"], line))
    except DescriptionError as error:
        for problem in error.problems:
            if isinstance(problem, Problem):
                reader.problems.add(problem)
        return None
    before = reader.problems.error_count
    robot = _with_limits(config.robot, values.get("limits", {}), entries.get("limits"), reader)
    tip = values.get("tip", "")
    if tip not in robot.links:
        message = (
            f"unknown link {tip!r}{did_you_mean(tip, robot.links)}" if tip else "name the link at the arm's end: tip"
        )
        reader.problems.error(entries.get("tip", each.entry), message)
        return None
    arm = Arm(each.name, values["mount"], values["model"], tip, home=values.get("home", {}))
    arm = replace(arm, tool=values.get("tool", arm.tool), bandwidth=values.get("bandwidth", arm.bandwidth))
    chain = [joint for joint in robot.chain(tip) if joint.is_driven]
    names = GripperNames()
    taken = {names.palm, *names.fingers, *names.joints} & {*robot.links, *robot.joint_indices}
    if arm.tool.kind == "parallel" and taken:
        reader.problems.error(entries["tool"], f"the robot has {min(taken)!r}, which is of the gripper; rename it")
    _check_home(arm, robot, each.table, reader)
    for problem in missing_for_cell(robot, path, [joint.name for joint in chain]):
        reader.problems.add(problem)
    collision = values.get("collision", CollisionShapes())
    _check_primitives(collision, robot, each.table, reader)
    drives = _given(each, config.urdf_path, [joint.name for joint in chain], reader)
    made = ArmModel(robot, config.base_pose, collision, drives)
    return None if reader.problems.error_count > before else (arm, made)


def _given(each: Named, path: Path, joints: Sequence[str], reader: Reader) -> dict[str, GivenDrive]:
    """Return the drives that an arm has from its file; none if it has stiff ones, or after an error."""
    if each.values.get("drives") != "as_given":
        return {}
    entries = each.table.entries
    if "bandwidth" in entries:
        reader.problems.error(entries["bandwidth"], "is of stiff drives; leave it out, or leave out drives: as_given")
    try:
        return given_drives(path, joints)
    except UsageError as error:
        reader.problems.error(entries["drives"], str(error))
        return {}


def _check_primitives(collision: CollisionShapes, robot: RobotModel, table: Table, reader: Reader) -> None:
    """Report shapes of links that the robot does not have."""
    for name in collision.primitives:
        if name not in robot.links:
            given = reader.table(table.entries["collision"].value)
            links = reader.table(given.entries["primitives"].value) if given else None
            assert links is not None
            reader.problems.error(links.entries[name], f"unknown link {name!r}{did_you_mean(name, robot.links)}")


def find_model(reference: str, node: Located, reader: Reader) -> Path | None:
    """Return the file of a model, beside the cell's or in a package of ROS or of Python; None after an error."""
    folder = Path(node.place.path).parent
    named = FileReference.read(reference)
    folders = [folder] if named.package is None else [*_packages(named.package, folder)]
    for place in folders:
        for path in named.paths:
            if (place / path).is_file():
                return place / path
    where = str(folder) if named.package is None else f"package {named.package!r}, of ROS or of Python"
    reader.problems.error(node, f"there is no file {reference} in {where}")
    return None


def _packages(name: str, folder: Path) -> Iterator[Path]:
    yield from package_folders(name, folder / "cell.yaml")
    try:
        found = importlib.util.find_spec(name)
    except (ImportError, ValueError):
        found = None
    yield from map(Path, (found.submodule_search_locations or ()) if found else ())


def _with_limits(
    robot: RobotModel, limits: Mapping[str, Mapping[str, float]], where: Entry | None, reader: Reader
) -> RobotModel:
    """Return a robot with other limits for some joints."""
    for name in limits:
        if where is not None and (name not in robot.joint_indices or not robot.joint(name).is_driven):
            reader.problems.error(where, f"unknown joint {name!r}{did_you_mean(name, [j.name for j in robot.driven])}")
    changed = tuple(
        replace(joint, limits=replace(joint.limits, **limits[joint.name])) if joint.name in limits else joint
        for joint in robot.joints
    )
    return replace(robot, joints=changed)


def _check_home(arm: Arm, robot: RobotModel, table: Table, reader: Reader) -> None:
    home = table.entries.get("home")
    for name, position in arm.home.items():
        assert home is not None
        if name not in robot.joint_indices or not robot.joint(name).is_driven:
            message = f"unknown joint {name!r}{did_you_mean(name, [each.name for each in robot.driven])}"
            reader.problems.error(home, message)
        elif not (limits := robot.joint(name).limits).lower - 1e-9 <= position <= limits.upper + 1e-9:
            message = f"{name}: must be from {limits.lower:g} to {limits.upper:g} (got {position:g})"
            reader.problems.error(home, message)
