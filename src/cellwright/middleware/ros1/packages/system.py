"""ROS 1's own tools on this machine: its Python, its message generators, and where its packages lie."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from cellwright.middleware.ros1.host import installation as installations
from cellwright.middleware.ros1.host.installation import Installation
from cellwright.middleware.ros1.packages.packages import PACKAGES
from cellwright.util.errors import UsageError


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


def find_system(installation: Installation | None = None) -> RosSystem:
    """The ROS 1 of this machine.

    Args:
        installation: which one, if it is not the one that a cell is served to.

    Raises:
        UsageError: there is none, or it cannot generate messages.
    """
    found = installations.find() if installation is None else installation
    for prefix in found.prefixes:
        ros = RosSystem(prefix, Path(found.python))
        if all((ros.generators / f"gen{kind}_py.py").is_file() for kind in ("msg", "srv")):
            return ros
    raise UsageError(
        f"ROS 1 is here without its generator of messages, genpy; {installations.HOW_TO_GET_IT.partition(';')[0]}"
    )


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
