"""Where ROS 1 is on this machine: an interpreter that has rospy, and its programs."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from cellwright.util.errors import UsageError

PYTHON_VARIABLE = "CELLWRIGHT_ROS1_PYTHON"
"""Environment variable: the interpreter to take, whatever else there is."""

SYSTEM_PYTHON = "/usr/bin/python3"
HOW_TO_GET_IT = (
    "on Debian 12 and Ubuntu: scripts/install-ros1, or apt install ros-core ros-robot-state-publisher; "
    f"another Python that has rospy is named by {PYTHON_VARIABLE}"
)
"""The end of a sentence that begins with what is missing."""

_LOOK = "import importlib.util, sys; sys.exit(importlib.util.find_spec('rospy') is None)"
_PATIENCE = 20.0  # [s]


@dataclass(frozen=True)
class Installation:
    """An installation of ROS 1: an interpreter that has rospy, and the whole environment that programs need."""

    python: str
    environment: Mapping[str, str]
    prefixes: tuple[Path, ...]  # folders with `lib/<package>/<program>`

    def program(self, name: str) -> str | None:
        """The path of a program on the search path; None if it is not there."""
        return shutil.which(name, path=self.environment.get("PATH"))

    def node(self, package: str, name: str) -> str | None:
        """The path of a node; None if it is not there."""
        for prefix in self.prefixes:
            path = prefix / "lib" / package / name
            if os.access(path, os.X_OK):
                return str(path)
        return None


def find(environment: Mapping[str, str] | None = None, *, root: Path = Path("/opt/ros")) -> Installation:
    """The ROS 1 of this machine: the one that is named, else the one of the shell, of /opt/ros, of the system.

    Raises:
        UsageError: there is none; the text says how to get one.
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
    raise UsageError(f"ROS 1 is needed, and {SYSTEM_PYTHON} has no rospy; {HOW_TO_GET_IT}")


def _installation(python: str, environment: Mapping[str, str]) -> Installation:
    chained = environment.get("CMAKE_PREFIX_PATH", "").split(os.pathsep)
    prefixes = [Path(each) for each in chained if each]
    return Installation(python, environment, (*prefixes, Path("/usr")))


def _sourced(root: Path, environment: Mapping[str, str]) -> Iterator[dict[str, str]]:
    """The environment after each installation's own setup, the newest first by name."""
    for setup in sorted(root.glob("*/setup.bash"), reverse=True):
        if not (setup.parent / "bin" / "rosmaster").exists():  # ROS 2 installs itself there too
            continue
        ran = _run(["/bin/bash", "-c", '. "$0" >/dev/null 2>&1; exec env -0', str(setup)], environment)
        if ran is not None:
            pairs = (each.partition("=") for each in ran.stdout.decode(errors="replace").split("\0"))
            yield {key: value for key, _, value in pairs if key}


def _has_rospy(python: str, environment: Mapping[str, str]) -> bool:
    ran = _run([python, "-c", _LOOK], environment)
    return ran is not None and ran.returncode == 0


def _run(command: list[str], environment: Mapping[str, str]) -> subprocess.CompletedProcess[bytes] | None:
    """What a program did; None if it could not be started, or took too long."""
    try:
        return subprocess.run(  # noqa: S603
            command,
            env=dict(environment),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=_PATIENCE,
            check=False,
            start_new_session=True,  # a Ctrl-C on the terminal would make it say no
        )
    except (OSError, subprocess.TimeoutExpired):
        return None


@dataclass(frozen=True, slots=True)
class RosSystem:
    """An installation of ROS 1: its prefix (`/usr` is Debian's), and the interpreter with rospy and the generators."""

    prefix: Path
    python: Path

    @property
    def generators(self) -> Path:
        """The folder of genpy's programs."""
        return self.prefix / "lib" / "genpy"

    @property
    def share(self) -> Path:
        """The folder of ROS packages."""
        return self.prefix / "share"

    def has_package(self, name: str) -> bool:
        """Whether it has a package of this name."""
        return (self.share / name / "package.xml").is_file()


def find_system() -> RosSystem:
    """The ROS 1 of this machine.

    Raises:
        UsageError: there is none, or it cannot generate messages.
    """
    found = find()
    for prefix in found.prefixes:
        ros = RosSystem(prefix, Path(found.python))
        if all((ros.generators / f"gen{kind}_py.py").is_file() for kind in ("msg", "srv")):
            return ros
    raise UsageError(f"ROS 1 is here without its generator of messages, genpy; {HOW_TO_GET_IT.partition(';')[0]}")


def tool_environment(ros: RosSystem) -> dict[str, str]:
    """The environment in which ROS's tools are started: this process's, but with ROS's Python modules alone."""
    variables = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONHOME")}
    modules = ros.prefix / "lib" / "python3" / "dist-packages"
    if modules.is_dir():
        variables["PYTHONPATH"] = str(modules)
    return variables
