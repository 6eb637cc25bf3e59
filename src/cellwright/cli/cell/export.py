"""Command `cellwright cell export`: a cell for MoveIt, or for the engine alone."""

import re
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from cellwright.cli import options
from cellwright.cli.arguments import Files, Overrides
from cellwright.cli.options import refuse
from cellwright.cli.output import progress_bar
from cellwright.cli.parameters import option
from cellwright.config.trial.gear2017 import Loaded
from cellwright.util.errors import UsageError
from cellwright.util.files import update_file, write_atomic

_PACKAGE = re.compile(r"[a-z][a-z0-9_]+", re.ASCII)


def export(
    files: Files,
    overrides: Overrides = None,
    moveit: Annotated[
        Path | None, option("FOLDER", "Write a ROS 2 package with a MoveIt configuration, named as the folder.")
    ] = None,
    mjcf: Annotated[Path | None, option("FILE", "Write the model of the engine, as an .xml file.")] = None,
) -> None:
    """Write a cell for other programs: MoveIt, or MuJoCo alone.

    MoveIt gets a description of the arms with everything that stands in the cell, groups, pairs of links that never
    touch, limits and controllers. Export again after a change of the cell: files that you changed are kept with a
    tilde.

        cellwright ros2-workspace ros2_ws
        cellwright cell export lesson --moveit ros2_ws/src/cellwright_moveit_config
        (cd ros2_ws && colcon build)

    The engine's model has the shapes that are touched, and the parts; a run begins in its key frame `home`.

        cellwright cell export lesson --mjcf lesson.xml
        python -m mujoco.viewer --mjcf=lesson.xml

    Exit status: 0 when everything is written, 2 when the cell cannot be used or a file cannot be written.
    """
    if moveit is None and mjcf is None:
        refuse("nothing to write; give --moveit FOLDER or --mjcf FILE")
    options.output_file("--mjcf", mjcf, ".xml")
    if moveit is not None:
        _check_package(moveit)
    (loaded,) = options.load_variants(files, [options.overrides(overrides)])
    if moveit is not None:
        _write_package(loaded, moveit)
    if mjcf is not None:
        from cellwright.cell.export.mjcf import mjcf_text  # slow to load

        write_atomic(mjcf, mjcf_text(loaded.trial))
        typer.echo(f"written: {mjcf}")


def _check_package(folder: Path) -> None:
    name = folder.resolve().name
    if not _PACKAGE.fullmatch(name):
        refuse(f"--moveit {folder}: a package is named in small letters, digits and underscores (got {name!r})")
    if folder.exists() and not folder.is_dir():
        refuse(f"--moveit {folder}: is not a folder")


def _write_package(loaded: Loaded, folder: Path) -> None:
    from cellwright.cell.export.moveit import moveit_package  # slow to load

    if not loaded.trial.arms:
        refuse(f"--moveit {folder}: {loaded.trial.name} has no arm to plan for; add one under cell: arms:")
    with progress_bar(Console(stderr=True), "searching for pairs of links that never touch", 1.0) as show:
        content = moveit_package(loaded.trial, folder.resolve().name, show or (lambda _share: None), loaded.places)
    try:
        for path, text in content.items():
            update_file(folder / path, text)
    except OSError as error:
        raise UsageError(f"--moveit {folder}: cannot be written: {error.strerror or error}") from None
    typer.echo(f"written: {folder}")
