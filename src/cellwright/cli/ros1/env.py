"""`cellwright ros1-env`: the paths that a shell needs for ROS's tools."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cellwright.cli.exit_status import DONE
from cellwright.cli.options import refuse
from cellwright.middleware.ros1.packages.system import find_system
from cellwright.middleware.ros1.packages.tree import SHELLS, cache_folder, ensure_tree, shell_lines, variables


def ros1_env(
    folder: Annotated[
        Path | None,
        typer.Option("--dir", metavar="DIR", help="Where the packages are laid out; the user's cache when left out."),
    ] = None,
    shell: Annotated[str, typer.Option(metavar="SHELL", help="Whose language: `sh` (bash, zsh) or `fish`.")] = "sh",
) -> None:
    """Print the paths with which ROS 1's tools know the cell, and the robot.

    Messages, launcher and configurations are laid out once, as ROS packages. In a shell that has the paths, `python`
    and `python3` are the interpreter that has ROS.

        # bash, zsh
        eval "$(cellwright ros1-env)"

        # fish
        cellwright ros1-env --shell fish | source

        # and then, with ROS's own tools
        rosrun osrf_gear gear.py -f "$(rospack find osrf_gear)/config/sample.yaml"
        rosrun io_teleop_robot_control_node openloong_controller_node.py

    Exit status: 0 done; 2 there is no ROS 1, or the folder cannot be written.
    """
    if shell not in SHELLS:
        refuse(f"--shell {shell}: give one of {', '.join(SHELLS)}")
    ros = find_system()
    tree = ensure_tree(ros, folder or cache_folder())
    typer.echo(shell_lines(variables(tree, ros), shell))
    raise typer.Exit(DONE)
