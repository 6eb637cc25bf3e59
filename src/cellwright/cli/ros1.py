"""Commands `cellwright ros1-env` and `cellwright ros1-workspace`: ROS 1 packages of the cell."""

import time
from pathlib import Path
from typing import Annotated

import typer

from cellwright.cli.main import DONE
from cellwright.cli.options import refuse
from cellwright.cli.parameters import argument, flag, option
from cellwright.cli.shell import SHELL_HELP, check_shell, shell_lines
from cellwright.middleware.ros1.host.installation import find_system
from cellwright.middleware.ros1.packages import workspace
from cellwright.middleware.ros1.packages.tree import cache_folder, ensure_tree, variables


def ros1_env(
    folder: Annotated[
        Path | None, option("DIR", "Folder for the packages. Default: the user's cache.", name="--dir")
    ] = None,
    shell: Annotated[str, option("SHELL", SHELL_HELP)] = "sh",
) -> None:
    """Print the paths with which ROS 1 tools find the packages of the cell and the robot.

    The first call writes messages, launcher and configurations as ROS packages. In a shell with these paths, `python`
    and `python3` are the interpreter of ROS.

        # bash, zsh
        eval "$(cellwright ros1-env)"

        # fish
        cellwright ros1-env --shell fish | source

        # then, with ROS 1 tools
        rosrun osrf_gear gear.py -f "$(rospack find osrf_gear)/config/sample.yaml"
        rosrun io_teleop_robot_control_node openloong_controller_node.py

    Exit status: 0 done; 2 there is no ROS 1, or the folder cannot be written.
    """
    check_shell(shell)
    ros = find_system()
    tree = ensure_tree(ros, folder or cache_folder())
    typer.echo(shell_lines(variables(tree, ros), shell))
    raise typer.Exit(DONE)


def ros1_workspace(
    folder: Annotated[Path, argument("DIR", "Workspace folder, such as `~/simulation_ws`.")],
    is_built: Annotated[bool, flag("--build/--no-build", "Build the workspace with catkin_make.")] = True,
) -> None:
    """Create a catkin workspace with the cell's packages, for programs in C++ or Python.

    The packages go to DIR/src/ariac, that of a robot's node to DIR/src/io_teleop; put your own into DIR/src. In an
    existing workspace the packages are updated, and nothing else is touched.

        cellwright ros1-workspace simulation_ws
        cd simulation_ws/src
        catkin_create_pkg my_robot rospy osrf_gear
        cd ..
        catkin_make --pkg my_robot
        source install/setup.bash

    Exit status: 0 done; 2 there is no ROS 1, a build tool is missing, or the build failed.
    """
    if folder.exists() and not folder.is_dir():
        refuse(f"{folder}: is not a folder")
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
        typer.echo(f"next: source {folder / 'install' / 'setup.bash'}")
    raise typer.Exit(DONE)
