"""ROS 1 tools on this machine: Python, message generators, and manifests for packages without one.

Debian has the definitions of standard messages in packages without a manifest, unless their files for C++ are there
too. Then `rosmsg show std_msgs/String` knows no such package. A manifest beside a link to the definitions is enough.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from subprocess import PIPE

from cellwright.middleware.ros1.host import installation as installations
from cellwright.middleware.ros1.packages.contents import PACKAGES
from cellwright.util.errors import UsageError


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
    found = installations.find()
    for prefix in found.prefixes:
        ros = RosSystem(prefix, Path(found.python))
        if all((ros.generators / f"gen{kind}_py.py").is_file() for kind in ("msg", "srv")):
            return ros
    raise UsageError(
        f"ROS 1 is here without its generator of messages, genpy; {installations.HOW_TO_GET_IT.partition(';')[0]}"
    )


def provided_packages(ros: RosSystem) -> list[str]:
    """Names of our packages that a shell is to have; the messages of controllers only where ROS itself lacks them."""
    return [name for name in PACKAGES if name != "control_msgs" or not ros.has_package(name)]


def tool_environment(ros: RosSystem) -> dict[str, str]:
    """The environment in which ROS's tools are started: this process's, but with ROS's Python modules alone."""
    variables = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONHOME")}
    modules = ros.prefix / "lib" / "python3" / "dist-packages"
    if modules.is_dir():
        variables["PYTHONPATH"] = str(modules)
    return variables


_PATIENCE = 120.0  # [s] for one generator


def generate_modules(ros: RosSystem, packages: Path, names: Sequence[str], modules: Path) -> None:
    """Write the modules of packages (`from osrf_gear.msg import Order`) to a folder that is to be on Python's path.

    Raises:
        UsageError: a generator failed; the error has what it said last.
    """
    search = [f"-I{name}:{packages / name / 'msg'}" for name in names]
    search += [f"-I{folder.parent.name}:{folder}" for folder in sorted(ros.share.glob("*/msg")) if folder.is_dir()]
    environment = tool_environment(ros)
    running = [
        (command, subprocess.Popen(command, env=environment, stdout=PIPE, stderr=PIPE, text=True))  # noqa: S603
        for name in names
        for command in _generator_commands(ros, packages / name, modules / name, search)
    ]
    said = [(command, process, *process.communicate(timeout=_PATIENCE)) for command, process in running]
    for command, process, out, error in said:
        if process.returncode != 0:
            last = ((error or out).strip().splitlines() or ["without a word"])[-1]
            raise UsageError(f"{Path(command[1]).name} failed for {command[-1]}: {last}")
    for name in names:
        (modules / name / "__init__.py").touch()
        for namespace in ("msg", "srv"):
            folder = modules / name / namespace
            if folder.is_dir():
                stems = sorted(path.stem for path in folder.glob("_*.py") if path.stem != "__init__")
                lines = "".join(f"from .{stem} import *\n" for stem in stems)
                (folder / "__init__.py").write_text(lines, encoding="utf-8")


def _generator_commands(ros: RosSystem, package: Path, modules: Path, search: Sequence[str]) -> Iterator[list[str]]:
    for namespace in ("msg", "srv"):
        definitions = sorted(map(str, (package / namespace).glob(f"*.{namespace}")))
        if definitions:
            out = modules / namespace
            out.mkdir(parents=True, exist_ok=True)
            program = str(ros.generators / f"gen{namespace}_py.py")
            yield [str(ros.python), program, *definitions, *search, "-p", package.name, "-o", str(out)]


STUB_MANIFEST = """<?xml version="1.0"?>
<package format="2">
  <name>{name}</name>
  <version>0.0.0</version>
  <description>Stands in for the manifest of the definitions in {source}.</description>
  <maintainer email="cellwright@example.com">The Cellwright project</maintainer>
  <license>BSD</license>
</package>
"""


def packages_without_manifest(share: Path) -> list[str]:
    """The packages in a folder that define messages or services and have no manifest, sorted."""
    folders = {
        path.parent for kind in ("msg", "srv") for path in share.glob(f"*/{kind}") if any(path.glob(f"*.{kind}"))
    }
    return sorted(folder.name for folder in folders if not (folder / "package.xml").exists())


def write_stubs(share: Path, packages: Path) -> list[str]:
    """Make each package of `share` that has no manifest known, in the folder `packages`; their names."""
    names = packages_without_manifest(share)
    for name in names:
        stub = packages / name
        stub.mkdir(parents=True)
        (stub / "package.xml").write_text(STUB_MANIFEST.format(name=name, source=share / name), encoding="utf-8")
        for kind in ("msg", "srv"):
            if (share / name / kind).is_dir():
                (stub / kind).symlink_to(share / name / kind)
    return names
