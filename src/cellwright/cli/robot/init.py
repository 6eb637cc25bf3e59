"""`cellwright robot --init`: the beginning of a configuration file."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import typer

from cellwright.cli.options import refuse
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.config_reader import read_robot_config
from cellwright.config.robot.skeleton import skeleton


def write_skeleton(config: RobotConfig, file: Path) -> None:
    """Write the beginning of a configuration for a robot, and say what is in it.

    Raises:
        UsageError: there is such a file already, or it cannot be written.
    """
    if not file.parent.is_dir():
        refuse(f"--init {file}: there is no folder {file.parent}")
    text = skeleton(config.robot, config.urdf_path.resolve(), file.parent.resolve())
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        refuse(f"--init {file}: is there already; take another name, or remove it")
    except OSError as error:
        with suppress(OSError):
            file.unlink()  # a half of it, for all that is known
        refuse(f"--init {file}: cannot be written: {error.strerror}")
    found = read_robot_config(file, lambda _line: None)
    groups = {"arm": len(found.arms), "gripper": len(found.grippers), "head": int(found.head is not None)}
    groups |= {"waist": int(found.waist is not None), "lift": int(found.dorsal is not None)}
    listed = ", ".join(f"{count} {name}{'' if count == 1 else 's'}" for name, count in groups.items() if count)
    typer.echo(f"{file}: {listed or 'no groups found'}, all guessed; go through it, then: cellwright check {file}")
