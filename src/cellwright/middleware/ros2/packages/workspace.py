"""Colcon workspace with Cellwright's packages as sources, in DIR/src: for programs of a ROS 2 distribution."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path

from cellwright.middleware.ros2.packages.contents import JAZZY, LAUNCH, interface_packages, package_files
from cellwright.util.errors import UsageError
from cellwright.util.files import update_file

_LAST_LINES = 30  # of the output of a build that failed


def lay_out(folder: Path, environment: Mapping[str, str] = os.environ) -> dict[str, Path]:
    """Write the sources to a folder, or bring them up to date there; other sources stay untouched.

    Packages that a sourced prefix already has are left out, but for those that this workspace has installed.

    Args:
        folder: the workspace.
        environment: variables of the shell; AMENT_PREFIX_PATH has the prefixes, ROS_DISTRO the distribution.

    Returns:
        The prefix of each package that was left out, by its name.

    Raises:
        UsageError: the folder cannot be written.
    """
    folder = folder.absolute()
    left_out = {}
    try:
        for package in (LAUNCH, *interface_packages()):
            if prefix := _prefix_with(package, folder, environment):
                left_out[package] = prefix
                continue
            files = package_files(package, environment.get("ROS_DISTRO") or JAZZY)
            for path, content in files.items():
                update_file(folder / "src" / package / path, content)
    except OSError as error:
        raise UsageError(f"{folder}: cannot write a workspace: {error.strerror or error}") from None
    return left_out


def _prefix_with(package: str, folder: Path, environment: Mapping[str, str]) -> Path | None:
    """Return the first prefix outside of a folder that has a package; None if there is none."""
    prefixes = [Path(each) for each in environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if each]
    for prefix in prefixes:
        is_ours = prefix.resolve().is_relative_to(folder.resolve())
        if not is_ours and (prefix / "share" / package / "package.xml").is_file():
            return prefix
    return None


def check_build_tools(environment: Mapping[str, str] = os.environ) -> None:
    """Check that colcon can build here.

    Raises:
        UsageError: colcon is missing, or the shell has no ROS 2; the text has a remedy.
    """
    if shutil.which("colcon", path=environment.get("PATH")) is None:
        raise UsageError("colcon: no such program; run: apt-get install python3-colcon-common-extensions")
    if not environment.get("AMENT_PREFIX_PATH"):
        raise UsageError("AMENT_PREFIX_PATH is not set; source a ROS 2 distribution first: . /opt/ros/jazzy/setup.sh")


def build(folder: Path, environment: Mapping[str, str] = os.environ) -> None:
    """Build the whole workspace with colcon.

    Raises:
        UsageError: a tool is missing, or the build failed; the error ends with colcon's last lines.
    """
    check_build_tools(environment)
    ran = subprocess.run(
        ["colcon", "build"],  # noqa: S607
        cwd=folder,
        env=dict(environment) | {"PWD": str(folder.absolute())},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        check=False,
    )
    if ran.returncode != 0:
        raise UsageError("\n".join(["colcon build failed:", *ran.stdout.splitlines()[-_LAST_LINES:]]))
