"""Robots by name or path: bundled robots, configuration files in all revisions, and plain URDF and MJCF files.

The reader reads the entries that the file's own node read. It keeps known entries of the headset's side without using
them, and warns of unknown ones. It refuses a file that has no meaning or names the wrong joint, and lists all errors at
once.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

from cellwright.config.parsing.reader import Keys, Reader, choice, numbers
from cellwright.config.parsing.sources import read_texts
from cellwright.config.parsing.tree import Items, Leaf, Problems, Table, YamlNode, describe, plain, refusal
from cellwright.config.parsing.yaml_source import parse_mapping, refuse_lost_indentation
from cellwright.config.robot.cameras import read_cameras
from cellwright.config.robot.config import UNUSED, ArmConfig, Posture, RobotConfig
from cellwright.config.robot.group_reader import GroupReader, numbered
from cellwright.config.robot.groups import check_arms, check_shared, check_sides
from cellwright.config.robot.mjcf import read_mjcf
from cellwright.config.robot.mjcf_file import is_mjcf
from cellwright.config.robot.model import RobotModel
from cellwright.config.robot.urdf import read_urdf
from cellwright.config.robot.urdf_file import NO_ARGUMENTS, Arguments
from cellwright.util.errors import DescriptionError, UnknownNameError, did_you_mean
from cellwright.util.files import open_to_read
from cellwright.util.pose import Pose, normalized

INDEX_ORDERS = ("pybullet", "urdf")
"""Orders in which a file may count joints; the first is the default."""

_GROUPS = ("arms", "grippers", "head", "dorsal", "waist", "folding_waist", "controller_indices", "cameras")
ENTRIES = Keys(
    {"urdf_path": None},
    {
        "xacro_arguments": None,
        "robot_name": Reader.name,
        "base_pose": None,
        "fixed_link": None,
        "joint_index_order": choice(INDEX_ORDERS),
        **dict.fromkeys(_GROUPS),
        "wo_controller": Reader.boolean,
        "base_command_mode": choice(("delta", "velocity")),
    },
)
"""Entries on the robot's placement, the groups of its joints, and the meaning of commands."""

BASE_POSES = Keys(optional={"position": numbers(3, "x, y, z [m]"), "orientation": numbers(4, "x, y, z, w")})
CONTROLLERS = Keys(optional=dict.fromkeys(("cmd_ee", "base")))
FOLDING_WAIST_UNUSED = ("rot_offset", "cmd_ee", "base")

_NEARBY = tuple(f"{levels}*.{suffix}" for levels in ("", "*/", "*/*/") for suffix in ("urdf", "xacro"))
_NORM_TOLERANCE = 0.01  # tolerance of a quaternion's length before a warning: 0.707 is rounding
CONFIG = "vr_configs.yml"
"""Name of the configuration file in a robot's folder."""
_CONFIGS = (CONFIG, "vr_configs.yaml")
_YAML, _URDF = (".yml", ".yaml"), (".urdf", ".xacro")
_CATALOGUE = Path(str(files("cellwright.config.robot"))) / "catalogue"
Warn = Callable[[str], None]
"""Callback for a warning, `path:line: key: what`."""


def find_urdf(node: YamlNode, reader: Reader) -> Path | None:
    """Return the URDF; its path is relative to the configuration's folder or, in old revisions, to the one above."""
    if not isinstance(node, Leaf) or not isinstance(node.value, str) or not node.value.isprintable() or not node.value:
        reader.problems.error(node, f"must be the path of a URDF, xacro or MJCF file (got {describe(node)})")
        return None
    folder = Path(node.place.path).parent
    for found in (folder / node.value, folder.parent / node.value):
        try:
            if found.is_file():
                return found
        except OSError:  # a name too long for the file system, or a folder without read permission
            break
    hint = _similar_urdf_hint(node.value, folder)
    reader.problems.error(node, f"there is no file {node.value} in {folder.absolute()} or in the folder above{hint}")
    return None


def _similar_urdf_hint(name: str, folder: Path) -> str:
    """Return a hint about a URDF in the folder that has a similar name, or the only one there."""
    try:
        found = [str(path.relative_to(folder)) for pattern in _NEARBY for path in folder.glob(pattern)]
    except OSError:
        return ""
    return did_you_mean(name, found) or (f"; did you mean {found[0]}" if len(found) == 1 else "")


def read_base_pose(node: YamlNode | None, reader: Reader) -> Pose:
    """Return the pose [m], its quaternion scaled to unit length; the identity by default."""
    table = reader.table(node) if node else None
    if table is None:
        return Pose()
    values = BASE_POSES.read(table, reader)
    if len(values) < sum(key in table for key in BASE_POSES.names):
        return Pose()
    position = values.get("position", (0.0, 0.0, 0.0))
    reader.check_coordinates(table.get("position") or table, position)
    x, y, z, w = values.get("orientation", (0.0, 0.0, 0.0, 1.0))
    length = math.hypot(x, y, z, w)
    where = table.get("orientation") or table
    if not 1e-6 < length < 1e6:
        reader.problems.error(where, f"must be a unit quaternion x, y, z, w (got length {length:g})")
        return Pose()
    if abs(length - 1.0) > _NORM_TOLERANCE:
        reader.problems.warn(where, f"must be a unit quaternion (got length {length:.3g}); it is scaled")
    return Pose((position[0], position[1], position[2]), normalized((w, x, y, z)))


def read_arguments(node: YamlNode | None, reader: Reader) -> dict[str, str]:
    """Return the arguments of a xacro file, as the texts that `NAME:=VALUE` has; none by default."""
    table = reader.table(node) if node else None
    found: dict[str, str] = {}
    for entry in table.entries.values() if table else ():
        name, value = reader.key(entry), entry.value
        if isinstance(value, Leaf) and isinstance(value.value, bool | str):
            text: str | None = str(value.value).lower() if isinstance(value.value, bool) else value.value
        else:
            text = reader.name(value)
        if name is not None and text is not None:
            found[name] = text
    return found


def read_robot_config(path: Path, warn: Warn, arguments: Arguments = NO_ARGUMENTS) -> RobotConfig:
    """Return the robot of a configuration file; `warn` gets warnings about the file and its URDF.

    `arguments` of its xacro file replace those of the configuration.

    Raises:
        DescriptionError: the file or its URDF cannot be used; the error lists everything that is wrong.
    """
    problems = Problems()
    root = read_tree(path, problems)
    refuse_lost_indentation(root, (*ENTRIES.names, *UNUSED))
    reader = Reader(problems)
    values = ENTRIES.read(root, reader, tuple(UNUSED))
    urdf_node = root.get("urdf_path")
    urdf = find_urdf(urdf_node, reader) if urdf_node else None
    robot = None
    if urdf is not None:
        try:
            arguments = {**read_arguments(root.get("xacro_arguments"), reader), **arguments}
            robot, _ = _read_model(urdf, warn, arguments)
        except DescriptionError as error:
            raise DescriptionError((*problems.errors, *error.problems), (*problems.warnings, *error.warnings)) from None
    config = _FileEntries(root, reader, path, values).config(robot, urdf) if robot and urdf else None
    if config is None or problems.errors:
        raise DescriptionError(problems.errors, problems.warnings)
    config = replace(config, xacro_arguments=arguments)
    for warning in problems.warnings:
        warn(str(warning))
    return config


def read_tree(path: Path, problems: Problems) -> Table:
    """Return the top level of a file; an empty file is an empty table.

    Raises:
        DescriptionError: it is no YAML file with a mapping.
    """
    return parse_mapping(read_texts([path]), problems, "a robot configuration must be a mapping of entries")


@dataclass(frozen=True, slots=True)
class _FileEntries:
    """Reader of the entries of one file."""

    root: Table
    reader: Reader
    path: Path
    values: Mapping[str, Any]

    def config(self, robot: RobotModel, urdf: Path) -> RobotConfig:
        """Return the configuration; it is valid only if no errors were reported."""
        joints = numbered(robot, self.values.get("joint_index_order", INDEX_ORDERS[0]))
        groups = GroupReader(robot, joints, self.reader)
        arms = [(node, groups.arm(node)) for node in self._list_items("arms", "arms")]
        grippers = [(node, groups.gripper(node)) for node in self._list_items("grippers", "grippers")]
        lift, head, fixed = map(self.root.get, ("dorsal", "head", "fixed_link"))
        dorsal = groups.lift(lift) if lift else None
        head_posture, head_axes = groups.head(head) if head else (None, ())
        fixed_link = groups.link(fixed, may_be_root=True) if fixed else None
        found_arms = [(node, arm) for node, arm in arms if arm is not None]
        command_links, reference_links = self._controller(groups, found_arms)
        cameras = self.root.get("cameras")
        config = RobotConfig(
            robot=robot,
            name=self.values.get("robot_name") or robot.name,
            path=self.path,
            urdf_path=urdf,
            base_pose=read_base_pose(self.root.get("base_pose"), self.reader),
            fixed_link=fixed_link,
            arms=tuple(arm for _, arm in found_arms),
            grippers=tuple(gripper for _, gripper in grippers if gripper is not None),
            head=head_posture,
            head_axes=head_axes,
            dorsal=dorsal,
            waist=self._waist(groups),
            command_links=command_links,
            reference_links=reference_links,
            cameras=read_cameras(cameras, self.reader) if cameras else (),
            max_accelerations=groups.max_accelerations,
            others=self._other_entries(),
        )
        if not self.reader.problems.errors:
            check_shared(self.root, config, self.reader.problems)
            check_arms(found_arms, config, joints, self.reader.problems)
            check_sides(self.root, config, self.reader.problems)
        return config

    def _list_items(self, name: str, kind: str) -> Iterator[YamlNode]:
        """Yield the items of an optional list."""
        node = self.root.get(name)
        if isinstance(node, Items):
            yield from node.items
        elif node is not None:
            hint = "; start each with a dash" if isinstance(node, Table) else "; write [] for none"
            self.reader.problems.error(node, f"must be a list of {kind} (got {describe(node)}){hint}")

    def _waist(self, groups: GroupReader) -> Posture | None:
        """Return the waist, which includes the joints of a folding waist."""
        names = (("waist", ()), ("folding_waist", FOLDING_WAIST_UNUSED))
        found = [groups.posture(node, unused) for name, unused in names if (node := self.root.get(name))]
        parts = [posture for posture in found if posture is not None]
        joints = tuple(name for posture in parts for name in posture.joints)
        return Posture(joints, tuple(value for posture in parts for value in posture.home)) if parts else None

    def _controller(
        self, groups: GroupReader, arms: list[tuple[YamlNode, ArmConfig]]
    ) -> tuple[tuple[str, ...], tuple[str | None, ...]]:
        """Return the links that hand poses command, and those in whose frames they are given."""
        node = self.root.get("controller_indices")
        table = self.reader.table(node) if node else None
        if table is not None:
            self.reader.ignored(table, CONTROLLERS.names)
        own = tuple(arm.tip for _, arm in arms)
        commanded = self._links(table, "cmd_ee", groups, len(own), is_base=False)
        bases = self._links(table, "base", groups, len(own), is_base=True)
        reference = tuple(None if link == groups.robot.root else link for link in bases)
        return (commanded or own), (reference or (None,) * len(own))

    def _links(
        self, table: Table | None, name: str, groups: GroupReader, count: int, *, is_base: bool
    ) -> tuple[str, ...]:
        """Return a link for each arm; empty if there is no such entry."""
        node = table.get(name) if table else None
        if node is None:
            return ()
        items = node.items if isinstance(node, Items) else (node,)
        links = [groups.link(item, may_be_root=is_base) for item in items]
        if len(links) != count and not self.reader.problems.errors:
            self.reader.problems.error(
                node, f"must be one link for each arm (got {len(links)} for {count} arm{'' if count == 1 else 's'})"
            )
        return tuple(link for link in links if link is not None)

    def _other_entries(self) -> dict[str, Any]:
        """Return the entries that are kept as written, as plain values."""
        if without_gui := self.root.get("without_gui"):
            self.reader.boolean(without_gui)
        known = ("base_command_mode", *UNUSED)
        return {str(name): plain(entry.value) for name, entry in self.root.entries.items() if name in known}


def bundled() -> list[str]:
    """Return the names of the bundled robots."""
    return sorted(path.parent.name for path in _CATALOGUE.glob(f"*/{CONFIG}"))


def find_robot(name_or_path: str | Path) -> Path:
    """Return a robot's file: that of a bundled robot, else a path to a file or to a folder with one.

    Raises:
        UnknownNameError: it looks like a name, and there is no such robot, file or folder.
        DescriptionError: it looks like a path, and there is no file that describes a robot.
    """
    name, path = str(name_or_path), Path(name_or_path)
    if name in bundled():
        return _CATALOGUE / name / CONFIG
    try:
        if path.is_file():
            return path
        if path.is_dir():
            return _in_folder(path)
    except (OSError, ValueError):
        raise refusal(path, 0, "not a valid path") from None
    # a path, not a robot's name
    if path.suffix or path.name != name:
        raise refusal(path, 0, "not a regular file" if path.exists() else "there is no such file")
    raise UnknownNameError("robot", name, bundled())


def load_robot(name_or_path: str | Path, warn: Warn, arguments: Arguments = NO_ARGUMENTS) -> RobotConfig:
    """Return the robot in a file, or the bundled one of that name.

    Args:
        name_or_path: a bundled robot, a configuration file, a folder with one, or a URDF, xacro or MJCF file. With
            such a file alone the robot has no groups: its joints can be moved, and its home is 0.
        warn: callback for a warning to the file's author.
        arguments: arguments of the xacro file, by name; they replace those of a configuration.

    Raises:
        UnknownNameError: there is no robot of this name.
        DescriptionError: the files cannot be used.

    Example:
        >>> config = load_robot("tandem", warn=print)
        >>> config.name, [arm.tip for arm in config.arms], len(config.robot.joints)
        ('tandem', ['right_tip', 'left_tip'], 21)
    """
    path = find_robot(name_or_path)
    if is_urdf(path):
        robot, placed = _read_model(path, warn, arguments)
        given = dict(arguments)
        return RobotConfig(
            robot=robot, name=robot.name, path=path, urdf_path=path, base_pose=placed, xacro_arguments=given
        )
    return read_robot_config(path, warn, arguments)


def _read_model(path: Path, warn: Warn, arguments: Arguments) -> tuple[RobotModel, Pose]:
    """Return the robot in a URDF or MJCF file, and where the file puts its root in the world [m]."""
    if not is_mjcf(path):
        return read_urdf(path, warn=warn, arguments=arguments), Pose()
    if arguments:
        raise refusal(path, 0, "an MJCF file takes no arguments; only files whose name ends in .xacro do")
    found = read_mjcf(path, warn=warn)
    return found.model, found.world_T_root


def is_urdf(path: Path) -> bool:
    """Return whether a file is a URDF or MJCF rather than a configuration, by its suffix or its first bytes."""
    if path.suffix.lower() in (*_YAML, *_URDF):
        return path.suffix.lower() in _URDF
    try:
        with open_to_read(path) as stream:
            return stream.read(200).lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<")
    except OSError:
        return False


def is_robot_file(path: Path) -> bool:
    """Return whether a file describes a robot, not a trial: a URDF, or YAML that names one or has a robot's entries."""
    if is_urdf(path):
        return True
    try:
        entries = read_tree(path, Problems()).entries
    except DescriptionError:
        return path.name in _CONFIGS
    known = sum(name in (*ENTRIES.names, *UNUSED) for name in entries)
    return "urdf_path" in entries or known > len(entries) / 2 or path.name in _CONFIGS


def _in_folder(folder: Path) -> Path:
    """Return the configuration in a folder, or its only URDF."""
    for name in _CONFIGS:
        if (folder / name).is_file():
            return folder / name
    found = sorted(path for place in (folder, folder / "urdf") for path in place.glob("*") if path.suffix in _URDF)
    if len(found) == 1:
        return found[0]
    names = ", ".join(str(path.relative_to(folder)) for path in found[:5])
    which = f"more than one URDF; name one of {names}" if found else "no URDF in this folder"
    raise refusal(folder, 0, f"no {CONFIG}, and {which}")
