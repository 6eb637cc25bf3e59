"""The robot that somebody means: one that comes along, a configuration file, a folder with one, or a plain URDF."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from cellwright.config.parsing.problems import Place, Problem, Problems
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.config_keys import READ, UNUSED
from cellwright.config.robot.config_reader import Warn, read_robot_config, read_tree
from cellwright.config.robot.urdf import read_urdf
from cellwright.util.errors import DescriptionError, UnknownNameError

CONFIG = "vr_configs.yml"
"""Name of the configuration file in a robot's folder."""

_CONFIGS = (CONFIG, "vr_configs.yaml")
_YAML, _URDF = (".yml", ".yaml"), (".urdf", ".xacro")
_CATALOGUE = Path(str(files("cellwright.config.robot"))) / "catalogue"


def bundled() -> list[str]:
    """The names of the robots that come with Cellwright."""
    return sorted(path.parent.name for path in _CATALOGUE.glob(f"*/{CONFIG}"))


def find_robot(name_or_path: str | Path) -> Path:
    """The file that is meant: of a robot that comes along, else a path to a file or to a folder with one.

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
        raise _refusal(path, "cannot be looked for") from None
    if path.suffix or path.name != name:  # no name of a robot
        raise _refusal(path, "there is no such file")
    raise UnknownNameError("robot", name, bundled())


def load_robot(name_or_path: str | Path, warn: Warn) -> RobotConfig:
    """The robot in a file, or the one of that name.

    Args:
        name_or_path: a robot that comes along, a configuration file, a folder with one, or a URDF (xacro) file. With
            a plain URDF the robot has no groups: its joints can be moved, and it has no home but 0.
        warn: takes a line about anything that its author should know.

    Raises:
        UnknownNameError: there is no robot of this name.
        DescriptionError: the files cannot be used.
    """
    path = find_robot(name_or_path)
    if is_urdf(path):
        robot = read_urdf(path, warn=warn)
        return RobotConfig(robot=robot, name=robot.name, path=path, urdf_path=path)
    return read_robot_config(path, warn)


def is_urdf(path: Path) -> bool:
    """Whether a file holds a URDF rather than a configuration: by its suffix, or by how it begins."""
    if path.suffix.lower() in (*_YAML, *_URDF):
        return path.suffix.lower() in _URDF
    try:
        with path.open("rb") as stream:
            return stream.read(200).lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<")
    except OSError:
        return False


def is_robot_file(path: Path) -> bool:
    """Whether a file describes a robot rather than a trial: a URDF, or YAML that names one or has a robot's entries."""
    if is_urdf(path):
        return True
    try:
        entries = read_tree(path, Problems()).entries
    except DescriptionError:
        return path.name in _CONFIGS
    known = sum(name in (*READ, *UNUSED) for name in entries)
    return "urdf_path" in entries or known > len(entries) / 2 or path.name in _CONFIGS


def _in_folder(folder: Path) -> Path:
    """The configuration in a folder, or its only URDF."""
    for name in _CONFIGS:
        if (folder / name).is_file():
            return folder / name
    found = sorted(path for place in (folder, folder / "urdf") for path in place.glob("*") if path.suffix in _URDF)
    if len(found) == 1:
        return found[0]
    names = ", ".join(str(path.relative_to(folder)) for path in found[:5])
    which = f"and more than one URDF: give one of {names}" if found else "and no URDF"
    raise _refusal(folder, f"a folder without {CONFIG} {which}")


def _refusal(path: Path, message: str) -> DescriptionError:
    return DescriptionError([Problem(Place(0, str(path), 0), "", message)])
