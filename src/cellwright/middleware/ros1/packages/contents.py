"""Contents of the ROS 1 packages: their files, and how they are written to a folder.

What another room already holds is not written down again: message definitions come from
`cellwright.middleware.messages`, bundled trials and robots from `cellwright.config`. Some files name paths of this
installation, which are put in here.
"""

from __future__ import annotations

import sys
from pathlib import Path

from cellwright._package import FOLDER
from cellwright.config.trial.catalogue import bundled, bundled_sensors, find_trial
from cellwright.middleware.messages.types import sources
from cellwright.middleware.ros1.host.installation import RosSystem
from cellwright.util.errors import UnknownNameError

IO_TELEOP = "io_teleop_robot_control_node"
PACKAGES = ("ariac_example", "cellwright_msgs", "control_msgs", IO_TELEOP, "osrf_gear")
MESSAGE_PACKAGES = ("cellwright_msgs", "control_msgs", "osrf_gear")  # those that define messages or services

CONFIGURATIONS = "config"
"""Where a package keeps trials, as the launcher is given them: `$(find osrf_gear)/config/sample.yaml`."""

ROBOTS = "io_teleop_robot_descriptions"
"""Where the io_teleop package keeps robots, a folder each: `OpenLoong/vr_configs.yml`."""

VENDORS_NAMES = {"qinglong": "OpenLoong"}
"""Bundled robots that the io_teleop workspace has under a name of its own."""

_QINGLONG, _ANY_ROBOT = "openloong_controller_node.py", "general_sim_robot_control_node.py"

_PYTHON, _PLACE, _BIN = '"@CELLWRIGHT_PYTHON@"', '"@CELLWRIGHT_PLACE@"', "@CELLWRIGHT_BIN@"


def provided_packages(ros: RosSystem) -> list[str]:
    """Names of our packages that a shell is to have; the messages of controllers only where ROS itself lacks them."""
    return [name for name in PACKAGES if name != "control_msgs" or not ros.has_package(name)]


def package_files(package: str, programs: Path) -> dict[str, bytes]:
    """Every file of a package by its path in it, sorted; shells are given the folder `programs` for `python`.

    Raises:
        UnknownNameError: there is no such package.
    """
    if package not in PACKAGES:
        raise UnknownNameError("ROS package", package, PACKAGES)
    found = _read(Path(__file__).parent / "data" / package)
    for name, text in sources().items():
        owner, namespace, last = name.split("/")
        if owner == package:
            found[f"{namespace}/{last}.{namespace}"] = text.encode()
    if package == "osrf_gear":
        for trial in (*bundled(), *bundled_sensors()):
            found.setdefault(f"{CONFIGURATIONS}/{trial}.yaml", find_trial(trial).read_bytes())
    if package == IO_TELEOP:
        for path, content in _read(Path(FOLDER) / "config" / "robot" / "catalogue").items():
            robot, _, rest = path.partition("/")
            found[f"{ROBOTS}/{VENDORS_NAMES.get(robot, robot)}/{rest}"] = content
        found[f"scripts/{_ANY_ROBOT}"] = (  # it finds the robot by its own name and its options
            found[f"scripts/{_QINGLONG}"]
            .replace(b"The QingLong's", b"Any robot's")
            .replace(_QINGLONG.encode(), _ANY_ROBOT.encode() + b" --robot_name NAME")
        )
    return {path: _placed(content, programs) for path, content in sorted(found.items())}


def _read(folder: Path) -> dict[str, bytes]:
    """Every file in a folder by its path in it."""
    paths = [path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


def _placed(content: bytes, programs: Path) -> bytes:
    """The content with the paths of this installation in it."""
    place = str(Path(FOLDER).parent)
    for mark, text in ((_PYTHON, repr(sys.executable)), (_PLACE, repr(place)), (_BIN, str(programs))):
        content = content.replace(mark.encode(), text.encode())
    return content


def write_package(package: str, folder: Path, programs: Path) -> None:
    """Bring a package in a folder up to date.

    What is as it should be is left alone, so that nothing is built again for nothing. A file that says something else
    is kept beside under its name with a tilde; files that are not the package's own are not touched.
    """
    for path, content in package_files(package, programs).items():
        write_file(folder / path, content)


def write_file(path: Path, content: bytes) -> None:
    """Write a file unless it is there as it should be; another one in its place is kept with a tilde."""
    mode = 0o755 if content.startswith(b"#!") else 0o644
    if path.is_file():
        if path.read_bytes() == content:
            path.chmod(mode)
            return
        path.replace(path.with_name(f"{path.name}~"))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    path.chmod(mode)


def write_programs(folder: Path, python: Path) -> None:
    """Links for a shell: `python`, as programs of the time ask for, and `python3` are ROS's Python."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("python", "python3"):
        link = folder / name
        if link.is_symlink() and link.readlink() == python:
            continue
        link.unlink(missing_ok=True)
        link.symlink_to(python)
