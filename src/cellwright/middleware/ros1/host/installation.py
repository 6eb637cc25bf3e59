"""Installation of ROS 1 on this machine: an interpreter that has rospy, and its programs."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from cellwright.util.errors import UsageError
from cellwright.util.process import run_briefly, sourced_environment

PYTHON_VARIABLE = "CELLWRIGHT_ROS1_PYTHON"
"""Environment variable: the interpreter that takes precedence over all others."""

SYSTEM_PYTHON = "/usr/bin/python3"
HOW_TO_GET_IT = (
    "on Debian 12 and Ubuntu: scripts/install-ros1, or apt install ros-core ros-robot-state-publisher; "
    f"set {PYTHON_VARIABLE} to use another Python that has rospy"
)
"""End of a sentence that begins with the missing part."""

_LOOK = "import importlib.util, sys; sys.exit(importlib.util.find_spec('rospy') is None)"


@dataclass(frozen=True)
class Installation:
    """Installation of ROS 1: an interpreter that has rospy, and the whole environment that programs need."""

    python: str
    environment: Mapping[str, str]
    prefixes: tuple[Path, ...]  # folders with `lib/<package>/<program>`

    def program(self, name: str) -> str | None:
        """Return the path of a program on the search path; None if it does not exist."""
        return shutil.which(name, path=self.environment.get("PATH"))

    def node(self, package: str, name: str) -> str | None:
        """Return the path of a node; None if it does not exist."""
        for prefix in self.prefixes:
            path = prefix / "lib" / package / name
            if os.access(path, os.X_OK):
                return str(path)
        return None


def find(environment: Mapping[str, str] | None = None, *, root: Path = Path("/opt/ros")) -> Installation:
    """Return the ROS 1 of this machine: of `PYTHON_VARIABLE`, else of the shell, of /opt/ros, of the system.

    Raises:
        UsageError: there is none; the text has installation instructions.
    """
    here = dict((os.environ if environment is None else environment).items())
    here.pop("PYTHONHOME", None)
    here.pop("ROS_NAMESPACE", None)  # set in a group of a launch file; our nodes have absolute names
    if named := here.get(PYTHON_VARIABLE):
        if not _has_rospy(named, here):
            raise UsageError(f"{PYTHON_VARIABLE} is {named}, which has no rospy; {HOW_TO_GET_IT}")
        return _installation(named, here)
    for each in (here, *_sourced(root, here)):
        if _has_rospy(SYSTEM_PYTHON, each):
            return _installation(SYSTEM_PYTHON, each)
    raise UsageError(f"ROS 1 is required, but {SYSTEM_PYTHON} has no rospy; {HOW_TO_GET_IT}")


def _installation(python: str, environment: Mapping[str, str]) -> Installation:
    chained = environment.get("CMAKE_PREFIX_PATH", "").split(os.pathsep)
    prefixes = [Path(each) for each in chained if each]
    return Installation(python, environment, (*prefixes, Path("/usr")))


def _sourced(root: Path, environment: Mapping[str, str]) -> Iterator[dict[str, str]]:
    """Yield the environment after each installation's own setup, the newest first by name."""
    for setup in sorted(root.glob("*/setup.bash"), reverse=True):
        if (setup.parent / "bin" / "rosmaster").exists():  # ROS 2 installs itself there too
            sourced = sourced_environment(setup, environment)
            if sourced is not None:
                yield sourced


def _has_rospy(python: str, environment: Mapping[str, str]) -> bool:
    ran = run_briefly([python, "-c", _LOOK], environment)
    return ran is not None and ran.returncode == 0


@dataclass(frozen=True, slots=True)
class RosSystem:
    """Prefix of a ROS 1 installation (`/usr` is Debian's), and the interpreter with rospy and the generators."""

    prefix: Path
    python: Path

    @property
    def generators(self) -> Path:
        """Folder of genpy's programs."""
        return self.prefix / "lib" / "genpy"

    @property
    def share(self) -> Path:
        """Folder of ROS packages."""
        return self.prefix / "share"

    def has_package(self, name: str) -> bool:
        """True if it has a package of this name."""
        return (self.share / name / "package.xml").is_file()


def find_system() -> RosSystem:
    """Return the ROS 1 of this machine.

    Raises:
        UsageError: there is none, or it cannot generate messages.
    """
    found = find()
    for prefix in found.prefixes:
        ros = RosSystem(prefix, Path(found.python))
        if all((ros.generators / f"gen{kind}_py.py").is_file() for kind in ("msg", "srv")):
            return ros
    raise UsageError(f"ROS 1 has no message generator (genpy); {HOW_TO_GET_IT.partition(';')[0]}")


def tool_environment(ros: RosSystem) -> dict[str, str]:
    """Return the environment for ROS's tools: this process's, but with only ROS's Python modules."""
    variables = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONHOME")}
    modules = ros.prefix / "lib" / "python3" / "dist-packages"
    if modules.is_dir():
        variables["PYTHONPATH"] = str(modules)
    return variables
