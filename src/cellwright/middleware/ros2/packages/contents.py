"""Contents of the ROS 2 packages: interface packages made from definitions, and the package of launch files.

- Packages of `cellwright.middleware.messages` are the same as in ROS 1, but for `Header`, `time` and `duration`.
- `data/control_msgs` and `data/tf2_msgs` have the names and fields that these packages have in ROS 2.
- `data/simulation_interfaces` is the standard's version 1.5.1, `data/controller_manager_msgs` the package of Jazzy.
- `kilted` has the definitions that are others from Kilted on.
- `data/cellwright` has the text of the launch files, with placeholders for paths of this installation and for what is
  started.
- `data/cellwright_moveit_config` has those files of a MoveIt configuration that depend on no cell; see `moveit`.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from cellwright._package import FOLDER
from cellwright.middleware.messages import TYPES
from cellwright.util.errors import UnknownNameError

JAZZY, KILTED = "jazzy", "kilted"
"""Distributions with different definitions: what is said of Kilted is so in later ones too."""

LAUNCH = "cellwright"
"""The package of launch files."""

MOVEIT = "cellwright_moveit_config"
"""The package of a MoveIt configuration, if it has no other name."""

STANDARD = ("std_srvs",)
"""Packages among the definitions that every ROS 2 has."""

_STARTED = {
    "cell": {"SUBJECT": "trial", "DEFAULT": "lesson", "FILE": "YAML", "COMMAND": "serve"},
    "robot": {"SUBJECT": "robot", "DEFAULT": "qinglong", "FILE": "URDF", "COMMAND": "teleop"},
}
"""Values of the placeholders in the launch file of each kind."""

_TEMPLATE = "template.launch.py"
_DATA = Path(__file__).parent / "data"
_FROM_KILTED_ON = Path(__file__).parent / KILTED
_IN_ROS2 = {"Header": "std_msgs/Header", "time": "builtin_interfaces/Time", "duration": "builtin_interfaces/Duration"}
_FIELD_OF_ROS1 = re.compile(rf"(?m)^([ \t]*)({'|'.join(_IN_ROS2)})(?=[ \t\[])")
_PACKAGE_OF_FIELD = re.compile(r"(?m)^[ \t]*([a-z]\w*)/")

_MANIFEST = """\
<?xml version="1.0"?>
<package format="3">
  <name>{name}</name>
  <version>0.1.0</version>
  <description>Interfaces of Cellwright's cells and robots: the package {name}.</description>
  <maintainer email="cellwright@example.com">The Cellwright project</maintainer>
  <license>Apache-2.0</license>

  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
{depends}  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>

  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
"""

_BUILD = """\
cmake_minimum_required(VERSION 3.16)
project({name})

find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
{finds}
rosidl_generate_interfaces(${{PROJECT_NAME}}
{files}{dependencies})

ament_export_dependencies(rosidl_default_runtime)
ament_package()
"""


def in_ros2(definition: str) -> str:
    """Return a definition with ROS 2's names for the built-in types of ROS 1; the rest stays as it is."""
    return _FIELD_OF_ROS1.sub(lambda found: found[1] + _IN_ROS2[found[2]], definition)


def definitions(distribution: str = JAZZY) -> dict[str, dict[str, str]]:
    """Return the text of every definition by package and path in it (`msg/Order.msg`), sorted.

    Args:
        distribution: ROS 2 distribution; their names are in the order of the alphabet.
    """
    return _definitions(is_late=distribution >= KILTED)


def varying_packages() -> list[str]:
    """Return the packages whose definitions depend on the distribution, sorted."""
    return sorted(path.name for path in _FROM_KILTED_ON.iterdir())


@cache
def _definitions(*, is_late: bool) -> dict[str, dict[str, str]]:
    found: dict[str, dict[str, str]] = {}
    for name, text in TYPES.sources.items():
        package, namespace, last = name.split("/")
        if package not in STANDARD:
            found.setdefault(package, {})[f"{namespace}/{last}.{namespace}"] = in_ros2(text)
    for folder in _DATA.iterdir():
        if folder.name not in (LAUNCH, MOVEIT):
            found[folder.name] = _texts(folder)
    for package in varying_packages() if is_late else ():
        found[package] |= _texts(_FROM_KILTED_ON / package)
    return dict(sorted(found.items()))


def _texts(folder: Path) -> dict[str, str]:
    """Return the definitions in the folder of a package by path."""
    paths = sorted(folder.glob("*/*"))
    return {path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8") for path in paths}


def interface_packages() -> list[str]:
    """Return the names of the packages that define interfaces, sorted."""
    return [*definitions()]


def dependencies(package: str, texts: Mapping[str, str]) -> list[str]:
    """Return the packages whose types the definitions of a package use, sorted."""
    found = {name for text in texts.values() for name in _PACKAGE_OF_FIELD.findall(text)}
    if any(path.endswith(".action") for path in texts):
        found.add("action_msgs")
    return sorted(found - {package})


def interface_files(package: str, texts: Mapping[str, str]) -> dict[str, bytes]:
    """Return every file of an interface package by its path in it: definitions, manifest and build file."""
    needed = dependencies(package, texts)
    manifest = _MANIFEST.format(name=package, depends="".join(f"  <depend>{name}</depend>\n" for name in needed))
    build = _BUILD.format(
        name=package,
        finds="".join(f"find_package({name} REQUIRED)\n" for name in needed),
        files="\n".join(f'  "{path}"' for path in sorted(texts)),
        dependencies=f"\n  DEPENDENCIES {' '.join(needed)}" if needed else "",
    )
    files = {path: text.encode() for path, text in texts.items()}
    return files | {"CMakeLists.txt": build.encode(), "package.xml": manifest.encode()}


def package_files(package: str, distribution: str = JAZZY) -> dict[str, bytes]:
    """Return every file of a package by its path in it, for a ROS 2 distribution.

    Of a MoveIt configuration they are those that depend on no cell.

    Raises:
        UnknownNameError: there is no such package.
    """
    if package in definitions():
        return interface_files(package, definitions(distribution)[package])
    if package not in (LAUNCH, MOVEIT):
        raise UnknownNameError("ROS 2 package", package, (LAUNCH, MOVEIT, *interface_packages()))
    folder = _DATA / package
    paths = [path for path in sorted(folder.rglob("*")) if path.is_file() and path.suffix != ".pyc"]
    files = {
        path.relative_to(folder).as_posix(): _placed(path.read_bytes()) for path in paths if path.name != _TEMPLATE
    }
    return files | (_launch_files(folder / "launch" / _TEMPLATE) if package == LAUNCH else {})


def _launch_files(template: Path) -> dict[str, bytes]:
    """Return the launch file of each kind by its path in the package."""
    files = {}
    for kind, values in _STARTED.items():
        text = template.read_text(encoding="utf-8")
        for mark, value in {"KIND": kind, **values}.items():
            text = text.replace(f"@{mark}@", value)
        files[f"launch/{kind}.launch.py"] = _placed(text.encode())
    return files


def _placed(content: bytes) -> bytes:
    """Return the content with the paths of this installation filled in."""
    place = str(Path(FOLDER).parent)
    for mark, text in (('"@CELLWRIGHT_PYTHON@"', repr(sys.executable)), ('"@CELLWRIGHT_PLACE@"', repr(place))):
        content = content.replace(mark.encode(), text.encode())
    return content
