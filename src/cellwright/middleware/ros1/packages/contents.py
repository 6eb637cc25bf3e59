"""Contents of the ROS 1 packages: their files, and functions that write them to a folder.

Message definitions come from `cellwright.middleware.messages`, bundled trials and robots from `cellwright.config`. Some
files have placeholders for paths of this installation, which are filled in here.
"""

from __future__ import annotations

import sys
from pathlib import Path

from cellwright._package import FOLDER
from cellwright.middleware.messages import TYPES
from cellwright.middleware.ros1.host.installation import RosSystem
from cellwright.middleware.wire.frames import ROS2_ONLY
from cellwright.util.errors import UnknownNameError
from cellwright.util.files import update_file

IO_TELEOP = "io_teleop_robot_control_node"
PACKAGES = ("ariac_example", "cellwright_msgs", "control_msgs", "controller_manager_msgs", IO_TELEOP, "osrf_gear")
MESSAGE_PACKAGES = ("cellwright_msgs", "control_msgs", "controller_manager_msgs", "osrf_gear")
"""Packages that define messages or services."""
OF_CONTROLLERS = ("control_msgs", "controller_manager_msgs")
"""Packages of `ros_control`, which Debian lacks."""

CONFIGURATIONS = "config"
"""A package's folder of trials, for the launcher: `$(find osrf_gear)/config/sample.yaml`."""

ROBOTS = "io_teleop_robot_descriptions"
"""The io_teleop package's folder of robots, with a folder for each: `OpenLoong/vr_configs.yml`."""

VENDORS_NAMES = {"qinglong": "OpenLoong"}
"""Bundled robots with another name in the io_teleop workspace."""

_CATALOGUES = Path(FOLDER) / "config"  # bundled trials and robots, which the packages hand on as files
_QINGLONG, _ANY_ROBOT = "openloong_controller_node.py", "general_sim_robot_control_node.py"

_ROS2_ONLY = ROS2_ONLY.partition("/")[2]
_PYTHON, _PLACE, _BIN = '"@CELLWRIGHT_PYTHON@"', '"@CELLWRIGHT_PLACE@"', "@CELLWRIGHT_BIN@"


def provided_packages(ros: RosSystem) -> list[str]:
    """Return the names of Cellwright's packages; the messages of controllers only if ROS itself lacks them."""
    return [name for name in PACKAGES if name not in OF_CONTROLLERS or not ros.has_package(name)]


def package_files(package: str, programs: Path) -> dict[str, bytes]:
    """Return every file of a package by its path in it, sorted; shells use `python` from the folder `programs`.

    Raises:
        UnknownNameError: there is no such package.
    """
    if package not in PACKAGES:
        raise UnknownNameError("ROS package", package, PACKAGES)
    found = _read(Path(__file__).parent / "data" / package)
    for name, text in TYPES.sources.items():
        owner, namespace, last = name.split("/")
        if owner == package and not last.startswith(_ROS2_ONLY):
            found[f"{namespace}/{last}.{namespace}"] = text.encode()
    if package == "osrf_gear":
        for path, content in _read(_CATALOGUES / "trial" / "catalogue").items():
            found.setdefault(f"{CONFIGURATIONS}/{path}", content)
    if package == IO_TELEOP:
        for path, content in _read(_CATALOGUES / "robot" / "catalogue").items():
            robot, _, rest = path.partition("/")
            found[f"{ROBOTS}/{VENDORS_NAMES.get(robot, robot)}/{rest}"] = content
        found[f"scripts/{_ANY_ROBOT}"] = (  # it finds the robot by its own file name and its options
            found[f"scripts/{_QINGLONG}"]
            .replace(b"The QingLong's", b"Any robot's")
            .replace(_QINGLONG.encode(), _ANY_ROBOT.encode() + b" --robot_name NAME")
        )
    return {path: _placed(content, programs) for path, content in sorted(found.items())}


def _read(folder: Path) -> dict[str, bytes]:
    """Return every file in a folder by its path in it."""
    paths = [path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


def _placed(content: bytes, programs: Path) -> bytes:
    """Return the content with the paths of this installation filled in."""
    place = str(Path(FOLDER).parent)
    for mark, text in ((_PYTHON, repr(sys.executable)), (_PLACE, repr(place)), (_BIN, str(programs))):
        content = content.replace(mark.encode(), text.encode())
    return content


def write_package(package: str, folder: Path, programs: Path) -> None:
    """Bring a package in a folder up to date.

    Files that are up to date stay untouched, so that builds do not repeat. A file with other content is kept under its
    name with a tilde; files that do not belong to the package stay.
    """
    for path, content in package_files(package, programs).items():
        update_file(folder / path, content)


def write_programs(folder: Path, python: Path) -> None:
    """Write links for a shell: `python`, for programs of 2017, and `python3` are ROS's Python."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("python", "python3"):
        link = folder / name
        if link.is_symlink() and link.readlink() == python:
            continue
        link.unlink(missing_ok=True)
        link.symlink_to(python)
