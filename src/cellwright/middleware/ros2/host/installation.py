"""Installation of ROS 2 on this machine: an interpreter that has rclpy, and its environment."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cellwright.middleware.ros2.packages.contents import interface_packages
from cellwright.middleware.ros2.packages.environment import DISTRIBUTIONS, RMW, complete_environments
from cellwright.middleware.ros2.packages.programs import BOOTSTRAP_VARIABLES
from cellwright.util.errors import UsageError
from cellwright.util.process import run_briefly, sourced_environment

PYTHON_VARIABLE = "CELLWRIGHT_ROS2_PYTHON"
"""Environment variable: the interpreter that takes precedence over all others."""

DOMAIN_VARIABLE = "ROS_DOMAIN_ID"
MAX_DOMAIN = 232
"""Largest domain: its ports of UDP begin at 7400 + 250 times its number, and ports end at 65535."""

HOW_TO_GET_IT = (
    "scripts/install-ros2 installs it on Linux; with a ROS 2 distribution, source its setup first; "
    f"set {PYTHON_VARIABLE} to use another Python that has rclpy"
)
"""End of a sentence that begins with the missing part."""

_LOOK = """
import json, os, sys
from importlib import metadata, util

import rclpy

try:
    wheel = metadata.version("ros-rclpy")
except metadata.PackageNotFoundError:
    wheel = ""
missing = [name for name in sys.argv[1:] if util.find_spec(name) is None]
print(json.dumps({"missing": missing, "wheel": wheel}))
"""
"""Program for an interpreter: loads rclpy, since one of another Python version is found and cannot be loaded."""

_OF_WHEEL = {"7": "jazzy", "9": "kilted"}
"""Distribution by the first number of a wheel's version of rclpy."""

_OF_A_SHELL = ("_", "OLDPWD", "PWD", "SHLVL")
"""Variables that a shell sets for itself."""


@dataclass(frozen=True)
class Installation:
    """Installation of ROS 2: an interpreter that has rclpy, and the whole environment that it needs.

    Attributes:
        python: path of the interpreter.
        environment: its environment, and that of other programs of ROS 2.
        distribution: name of the ROS 2 distribution, "jazzy"; empty if it is not known.
        missing_interfaces: packages of Cellwright's interfaces that the interpreter does not find.
        notes: lines for the user on variables that could not stay.
    """

    python: str
    environment: Mapping[str, str]
    distribution: str
    missing_interfaces: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def find(environment: Mapping[str, str] | None = None, *, root: Path = Path("/opt/ros")) -> Installation:
    """Return the ROS 2 of this machine: of `PYTHON_VARIABLE`, else of the shell, of /opt/ros, of our own environments.

    In /opt/ros the distributions that Cellwright is tested with come first, then others, the newest first by name.

    Raises:
        UsageError: there is none, and the text has installation instructions; or `ROS_DOMAIN_ID` is not valid.
    """
    here = dict((os.environ if environment is None else environment).items())
    _check_domain(here)
    here.pop("PYTHONHOME", None)
    if BOOTSTRAP_VARIABLES[1] in here:  # set by an interpreter with other wheels, which has started this process
        for name in BOOTSTRAP_VARIABLES:
            here.pop(name, None)
    if named := here.get(PYTHON_VARIABLE):
        if found := _asked(named, here):
            return found
        raise UsageError(f"{PYTHON_VARIABLE} is {named}, which has no rclpy; {HOW_TO_GET_IT}")
    is_sourced = here.get("ROS_VERSION", "2") == "2" and bool(here.get("ROS_VERSION") or here.get("AMENT_PREFIX_PATH"))
    for each in (*([here] if is_sourced else []), *_sourced(root, here)):
        for python in _pythons(each):
            if found := _asked(python, each):
                return found
    for distribution, folder in complete_environments(here):
        if found := _asked(str(folder / "bin" / "python3"), _own(distribution, folder, here)):
            return found
    raise UsageError(f"ROS 2 is required, but no Python here has rclpy; {HOW_TO_GET_IT}")


def _check_domain(environment: Mapping[str, str]) -> None:
    """Refuse a domain that no node can join: ROS 2 starts for seconds, and ends without a reason."""
    text = environment.get(DOMAIN_VARIABLE, "")
    if text and not (text.isascii() and text.isdecimal() and int(text) <= MAX_DOMAIN):
        raise UsageError(
            f"{DOMAIN_VARIABLE}: must be a whole number from 0 to {MAX_DOMAIN}, since higher domains have no ports "
            f"(got {text!r:.40}); set another, or unset it"
        )


def _pythons(environment: Mapping[str, str]) -> Iterator[str]:
    """Yield each `python3` on the search path: the first may be of a virtual environment that does not see ROS."""
    seen = set()
    for folder in environment.get("PATH", os.defpath).split(os.pathsep):
        path = os.path.join(folder, "python3")
        if folder and path not in seen and os.access(path, os.X_OK):
            seen.add(path)
            yield path


def _sourced(root: Path, environment: Mapping[str, str]) -> Iterator[dict[str, str]]:
    """Yield the environment after the setup of each ROS 2 distribution in a folder."""
    names = sorted((path.parent.name for path in root.glob("*/setup.bash")), reverse=True)
    for name in sorted(names, key=[*DISTRIBUTIONS, *(each for each in names if each not in DISTRIBUTIONS)].index):
        if not (root / name / "bin" / "rosmaster").exists():  # ROS 1 installs itself there too
            sourced = sourced_environment(root / name / "setup.bash", environment)
            if sourced is not None:
                kept = {each: environment[each] for each in _OF_A_SHELL if each in environment}
                yield {name: value for name, value in sourced.items() if name not in _OF_A_SHELL} | kept


def _own(distribution: str, folder: Path, environment: Mapping[str, str]) -> dict[str, str]:
    """Return an environment for one of our own folders, without modules of ROS 1 or of another Python."""
    kept = {name: value for name, value in environment.items() if name not in ("PYTHONPATH", "CMAKE_PREFIX_PATH")}
    return kept | {
        "AMENT_PREFIX_PATH": str(folder),
        "PATH": os.pathsep.join([str(folder / "bin"), environment.get("PATH", os.defpath)]),
        "ROS_DISTRO": distribution,
        "ROS_PYTHON_VERSION": "3",
        "ROS_VERSION": "2",
    }


def _asked(python: str, environment: Mapping[str, str]) -> Installation | None:
    """Return the installation of an interpreter, or None if it cannot load rclpy."""
    ran = run_briefly([python, "-c", _LOOK, *interface_packages()], environment)
    if ran is None or ran.returncode != 0:
        return None
    try:
        answer: dict[str, Any] = json.loads(ran.stdout.splitlines()[-1])
        wheel, missing = str(answer["wheel"]), tuple(answer["missing"])
    except (IndexError, KeyError, TypeError, ValueError):  # a program of another kind has this name
        return None
    distribution = environment.get("ROS_DISTRO") or ""
    if wheel:
        distribution = _OF_WHEEL.get(wheel.partition(".")[0], "")
    found = Installation(python, environment, distribution, missing)
    rmw = environment.get("RMW_IMPLEMENTATION", "")
    if not wheel or rmw in ("", RMW):
        return found
    note = f"RMW_IMPLEMENTATION={rmw} is ignored: ROS 2 of {python} has {RMW} alone"
    kept = {name: value for name, value in environment.items() if name != "RMW_IMPLEMENTATION"}
    return replace(found, environment=kept, notes=(note,))
