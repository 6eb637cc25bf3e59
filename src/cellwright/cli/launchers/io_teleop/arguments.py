"""Translation of the command lines of the vendor's scripts, and of copies of them, to those of `cellwright teleop`."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from cellwright.middleware.ros1.packages.contents import IO_TELEOP, ROBOTS, VENDORS_NAMES
from cellwright.util.errors import UnknownNameError

GENERAL = "general_sim_robot_control_node"
"""The script for any robot."""

GENERAL_NODE = "sim_robot_controller_node"
"""Its node name; other scripts have their own names as node names."""

CONFIGURATION = "vr_configs.yml"

_DEFAULT_ROBOT = "OpenLoong"
_REMAPPING = ":="
_NAME = "__name"


def command(script: str, arguments: Sequence[str], warn: Callable[[str], None]) -> list[str]:
    """Return the arguments of `cellwright` for a script, by its path, and its arguments.

    Options of the vendor's are translated, all others passed on: options of `cellwright teleop` work too.

    Raises:
        UnknownNameError: there is no such robot.
    """
    path = Path(script)
    is_general = path.stem == GENERAL
    node = GENERAL_NODE if is_general else path.stem
    own: list[str] = []
    for argument in arguments:
        name, mark, value = argument.partition(_REMAPPING)
        if not mark:
            own.append(argument)
        elif name == _NAME:
            node = value
        elif not name.startswith(("__", "_")):
            warn(f"{argument}: remapping ignored; names of topics and services are absolute")
    parser = argparse.ArgumentParser(prog=path.name, allow_abbrev=False, add_help=False)
    parser.add_argument("--robot_name", metavar="NAME", default=_DEFAULT_ROBOT)
    parser.add_argument("--init_debug", action="store_true")
    known, more = parser.parse_known_args(own)
    return [
        "teleop",
        find_robot(known.robot_name, path),
        "--ros1",
        f"--node={node}",
        "--port=0",
        *(["--motion=teleport"] if is_general else []),
        *(["--init-debug"] if known.init_debug else []),
        *more,
    ]


def find_robot(name: str, script: Path) -> str:
    """Return a robot's configuration: a folder of its name beside the scripts, or a path; else a bundled name.

    Raises:
        UnknownNameError: there is no such robot.
    """
    # The sources of a package, or their copies by `catkin_make install`.
    folders = [script.parents[1] / ROBOTS, *(each / "share" / IO_TELEOP / ROBOTS for each in script.parents[2:3])]
    candidates = [place for folder in folders for place in (folder / name / CONFIGURATION, folder / name)]
    for place in (*candidates, Path(name)):
        if place.is_file():
            return str(place)
    bundled = {theirs: ours for ours, theirs in VENDORS_NAMES.items()}
    if name in bundled or name in VENDORS_NAMES:
        return bundled.get(name, name)
    there = {path.parent.name for folder in folders for path in folder.glob(f"*/{CONFIGURATION}")}
    raise UnknownNameError("robot", name, sorted(there | set(bundled)))
