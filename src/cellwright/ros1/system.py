"""ROS 1's own tools on this machine: its Python, its message generators, and where its packages lie."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from cellwright.errors import UsageError
from cellwright.ros1.packages import PACKAGES

_PATIENCE = 20.0  # [s] for an interpreter to say whether it has a module


@dataclass(frozen=True, slots=True)
class RosSystem:
    """An installation of ROS 1.

    Attributes:
        prefix: `/usr` for Debian's own, else such as `/opt/ros/noetic`.
        python: the interpreter that has rospy and the generators.
    """

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


def find_system(root: Path = Path("/")) -> RosSystem:
    """The installation of ROS 1, the newest under `/opt/ros` first, then Debian's own.

    Args:
        root: where to look from; another one in tests.

    Raises:
        UsageError: there is none that can generate messages.
    """
    for prefix in _prefixes(root):
        ros = RosSystem(prefix, Path(os.environ.get("CELLWRIGHT_ROS1_PYTHON") or root / "usr" / "bin" / "python3"))
        if (ros.generators / "genmsg_py.py").is_file() and _has_genpy(ros):
            return ros
    raise UsageError(
        "no ROS 1 that can generate messages was found: install it, on Debian and Ubuntu with "
        "`apt-get install ros-core rosbash`, or name its Python in CELLWRIGHT_ROS1_PYTHON"
    )


def _prefixes(root: Path) -> Iterator[Path]:
    yield from sorted((root / "opt" / "ros").glob("*"), reverse=True)
    yield root / "usr"


def _has_genpy(ros: RosSystem) -> bool:
    command = [str(ros.python), "-c", "import genpy"]
    try:
        ran = subprocess.run(command, env=environment(ros), capture_output=True, timeout=_PATIENCE, check=False)  # noqa: S603
    except (OSError, subprocess.TimeoutExpired):
        return False
    return ran.returncode == 0


def wanted(ros: RosSystem) -> list[str]:
    """Names of our packages that a shell is to have; the messages of controllers only where ROS itself lacks them."""
    return [name for name in PACKAGES if name != "control_msgs" or not ros.has_package(name)]


def environment(ros: RosSystem) -> dict[str, str]:
    """The environment in which ROS's tools are started: this process's, but with ROS's Python modules alone."""
    variables = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONHOME")}
    modules = ros.prefix / "lib" / "python3" / "dist-packages"
    if modules.is_dir():
        variables["PYTHONPATH"] = str(modules)
    return variables
