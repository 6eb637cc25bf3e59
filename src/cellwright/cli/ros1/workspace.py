"""`cellwright ros1-workspace`: a catkin workspace with the cell's packages."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer

from cellwright.cli.exit_status import DONE
from cellwright.cli.options import refuse
from cellwright.middleware.ros1.packages import workspace
from cellwright.middleware.ros1.packages.system import find_system


def ros1_workspace(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="The workspace, such as `~/simulation_ws`.", show_default=False)
    ],
    is_built: Annotated[
        bool, typer.Option("--build/--no-build", metavar="", help="Build it at once, with catkin_make.")
    ] = True,
) -> None:
    """Lay out a catkin workspace that knows the cell, for programs in C++ or Python.

    The packages go to DIR/src/ariac, that of a robot's node to DIR/src/io_teleop; your own belong beside, in DIR/src.
    In a workspace that is there already they are brought up to date, and nothing else is touched.

        cellwright ros1-workspace simulation_ws
        cd simulation_ws/src
        catkin_create_pkg my_robot rospy osrf_gear
        cd ..
        catkin_make --pkg my_robot
        source devel/setup.bash

    Exit status: 0 done; 2 there is no ROS 1, something to build with is missing, or the build failed.
    """
    if folder.exists() and not folder.is_dir():
        refuse(f"{folder}: is no folder")
    ros = find_system()
    absent = workspace.missing(ros)
    if absent and is_built:
        refuse(workspace.lack(absent))
    workspace.lay_out(ros, folder)
    typer.echo(f"laid out {folder / 'src' / workspace.GROUP}")
    if is_built:
        started = time.perf_counter()
        workspace.build(ros, folder)
        typer.echo(f"built in {time.perf_counter() - started:.0f} s")
        typer.echo(f"next: source {folder / 'devel' / 'setup.bash'}")
    raise typer.Exit(DONE)
