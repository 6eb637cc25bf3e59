"""Catkin workspace with Cellwright's packages as sources, for programs that are built with catkin.

- src/ariac/            the packages of the cell, as in the workspaces of 2017
- src/io_teleop/        the package of the robot controller node
- src/CMakeLists.txt    catkin's top level, which uses ROS's Python whichever `python3` is on the path
- install/setup.bash    as `devel/setup.bash`, until `catkin_make install` writes its own
- .cellwright/bin/      python and python3: the interpreter that has ROS
"""

from __future__ import annotations

import shlex
import shutil
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path

from cellwright.middleware.ros1.host.installation import RosSystem, tool_environment
from cellwright.middleware.ros1.packages import contents
from cellwright.util.errors import UsageError
from cellwright.util.files import update_file

GROUP, GROUP_OF_ROBOTS = "ariac", "io_teleop"  # folders among the sources: of Cellwright's packages, of a robot's node

NEEDED = {
    "actionlib_msgs": "libactionlib-msgs-dev",
    "catkin": "catkin",
    "geometry_msgs": "libgeometry-msgs-dev",
    "message_generation": "ros-message-generation",
    "message_runtime": "ros-message-runtime",
    "roscpp": "libroscpp-dev",
    "rospy": "",  # part of every ROS 1 that was found
    "sensor_msgs": "libsensor-msgs-dev",
    "std_msgs": "libstd-msgs-dev",
    "std_srvs": "libstd-srvs-dev",
    "trajectory_msgs": "libtrajectory-msgs-dev",
}
"""ROS packages that Cellwright's, and the lesson's, are built with, and the Debian package of each."""

_TOP_LEVEL = """\
# Catkin's top level. It names ROS's Python, since the first python3 on the path may have no ROS.
cmake_minimum_required(VERSION 3.0.2)
project(Project)
if(NOT DEFINED PYTHON_EXECUTABLE)
  set(PYTHON_EXECUTABLE "{python}" CACHE FILEPATH "The Python that has ROS")
endif()
# Messages are generated for C++ and Python only, unless ROS_LANG_DISABLE is set.
if(NOT DEFINED ENV{{ROS_LANG_DISABLE}})
  set(ENV{{ROS_LANG_DISABLE}} "geneus:genlisp:gennodejs")
endif()
include("{toplevel}")
"""

_SETUP = """\
# Same as devel/setup.{shell}, until `catkin_make install` writes its own.
. {devel}
"""

_LAST_LINES = 30  # of the output of a build that failed


def lay_out(ros: RosSystem, folder: Path) -> None:
    """Write the sources to a folder, or bring them up to date there; other sources stay untouched.

    Raises:
        UsageError: the folder cannot be written.
    """
    folder = folder.absolute()
    programs = folder / ".cellwright" / "bin"
    try:
        for package in contents.provided_packages(ros):
            contents.write_package(
                package,
                folder / "src" / (GROUP_OF_ROBOTS if package == contents.IO_TELEOP else GROUP) / package,
                programs,
            )
        contents.write_programs(programs, ros.python)
        toplevel = ros.share / "catkin" / "cmake" / "toplevel.cmake"
        _write(folder / "src" / "CMakeLists.txt", _TOP_LEVEL.format(python=ros.python, toplevel=toplevel))
        for shell in ("bash", "sh", "zsh"):
            setup = folder / "install" / f"setup.{shell}"
            if not setup.exists():
                devel = shlex.quote(str(folder / "devel" / f"setup.{shell}"))
                _write(setup, _SETUP.format(shell=shell, devel=devel))
    except OSError as error:
        raise UsageError(f"{folder}: cannot write a workspace: {error.strerror or error}") from None


def missing(ros: RosSystem) -> list[str]:
    """Return what catkin would not find here: ROS packages by name, and programs."""
    packages = [name for name in NEEDED if not any(_configurations(ros, name))]
    return packages + [name for name in ("cmake", "make", "g++") if shutil.which(name) is None]


def _configurations(ros: RosSystem, name: str) -> Iterator[Path]:
    """Yield CMake's configuration of a ROS package; Debian has those with libraries in a folder by architecture."""
    for folder in (f"share/{name}/cmake", f"lib/*/cmake/{name}"):
        yield from ros.prefix.glob(f"{folder}/{name}Config.cmake")


def lack(names: Iterable[str]) -> str:
    """Return an error text with the missing names, and the command that installs them."""
    remedy = f"apt-get install {' '.join(sorted(filter(None, {'g++', *NEEDED.values()})))}"
    return f"catkin cannot build: {', '.join(names)} missing; on Debian, run: {remedy}"


def build(ros: RosSystem, folder: Path) -> None:
    """Build the whole workspace with `catkin_make`.

    Raises:
        UsageError: something is missing, or the build failed; the error ends with catkin's last lines.
    """
    if names := missing(ros):
        raise UsageError(lack(names))
    setup = ros.prefix / "setup.sh"
    before = f". {shlex.quote(str(setup))} && " if setup.is_file() else ""
    command = ["sh", "-c", f"{before}exec catkin_make"]
    ran = subprocess.run(  # noqa: S603
        command,
        cwd=folder,
        env=tool_environment(ros) | {"PWD": str(folder)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        check=False,
    )
    if ran.returncode != 0:
        raise UsageError("\n".join(["catkin_make failed:", *ran.stdout.splitlines()[-_LAST_LINES:]]))


def _write(path: Path, text: str) -> None:
    if path.is_symlink():  # from catkin_init_workspace
        path.unlink()
    update_file(path, text.encode())
