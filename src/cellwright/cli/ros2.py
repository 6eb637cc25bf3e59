"""Commands `cellwright ros2-env` and `cellwright ros2-workspace`: ROS 2 packages of cells and robots."""

import os
import shutil
import sys
import time
from pathlib import Path
from typing import Annotated

import typer

from cellwright.cli.main import DONE
from cellwright.cli.options import refuse
from cellwright.cli.parameters import argument, flag, option
from cellwright.cli.shell import SHELL_HELP, check_shell, shell_lines
from cellwright.middleware.ros2.host.installation import find
from cellwright.middleware.ros2.packages import workspace


def ros2_env(shell: Annotated[str, option("SHELL", SHELL_HELP)] = "sh") -> None:
    """Print the variables with which a shell's Python finds rclpy and the interfaces of cells and robots.

    In a shell with these variables, `python3` is the interpreter of the ROS 2 that `--ros2` uses.

        # bash, zsh
        eval "$(cellwright ros2-env)"

        # fish
        cellwright ros2-env --shell fish | source

        # then
        python3 -c "from osrf_gear.msg import Order; import rclpy"

    Exit status: 0 done; 2 there is no ROS 2.
    """
    check_shell(shell)
    found = find()
    wanted = dict(found.environment)
    if shutil.which("python3", path=wanted.get("PATH")) != found.python:
        wanted["PATH"] = os.pathsep.join([os.path.dirname(found.python), wanted.get("PATH", os.defpath)])
    changed = {name: wanted.get(name) for name in sorted({*wanted, *os.environ})}
    lines = shell_lines({name: value for name, value in changed.items() if os.environ.get(name) != value}, shell)
    if lines:
        typer.echo(lines)
    for note in found.notes:
        sys.stderr.write(f"note: {note}\n")
    if found.missing_interfaces:
        sys.stderr.write(
            f"note: {found.python} lacks {', '.join(found.missing_interfaces)}; "
            "run: cellwright ros2-workspace DIR --build, then source DIR/install/setup.bash\n"
        )
    raise typer.Exit(DONE)


def ros2_workspace(
    folder: Annotated[Path, argument("DIR", "Workspace folder, such as `~/ros2_ws`.")],
    is_built: Annotated[bool, flag("--build/--no-build", "Build the workspace with colcon.")] = False,
) -> None:
    """Create a colcon workspace with interfaces of cells and robots, and launch files.

    The packages go to DIR/src; put your own beside them. In an existing workspace the packages are updated, and
    nothing else is touched. Packages that the sourced ROS 2 has are left out.

        cellwright ros2-workspace ros2_ws --build
        source ros2_ws/install/setup.bash
        ros2 launch cellwright cell.launch.py trial:=lesson

    `cellwright cell export` adds a MoveIt configuration of a cell.

    Exit status: 0 done; 2 colcon or ROS 2 is missing, or the build failed.
    """
    if folder.exists() and not folder.is_dir():
        refuse(f"{folder}: is not a folder")
    if is_built:
        workspace.check_build_tools()
    left_out = workspace.lay_out(folder)
    typer.echo(f"laid out {folder / 'src'}")
    for package, prefix in left_out.items():
        typer.echo(f"left out {package}: it is in {prefix}")
    if is_built:
        started = time.perf_counter()
        workspace.build(folder)
        typer.echo(f"built in {time.perf_counter() - started:.0f} s")
        typer.echo(f"next: source {folder / 'install' / 'setup.bash'}")
    raise typer.Exit(DONE)
