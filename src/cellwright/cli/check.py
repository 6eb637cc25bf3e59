"""Command `cellwright check`: errors and warnings in the files of a trial or a robot."""

import json
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from cellwright.cell.checks.findings import cell_warnings
from cellwright.cell.checks.robots import robot_problems
from cellwright.cell.model.own_arm import arm_problems
from cellwright.cell.model.own_models import model_problems
from cellwright.cli import options
from cellwright.cli.arguments import Files, Overrides
from cellwright.cli.main import BAD_INPUT, DONE
from cellwright.cli.output import echo
from cellwright.cli.parameters import flag, option
from cellwright.config.check import Report
from cellwright.config.check import check as check_files
from cellwright.config.robot.robots import find_robot
from cellwright.util.errors import CellwrightError, UsageError


def check(
    files: Files,
    overrides: Overrides = None,
    map_file: Annotated[
        Path | None, option("FILE", "Draw the cell from above, as a .png or .svg file.", name="--map")
    ] = None,
    as_json: Annotated[bool, flag("--json", "Print findings and resolved values as JSON.")] = False,
) -> None:
    """Check the files of a trial or a robot: print errors and warnings, a line each, or ok. Nothing is run.

    Errors make a file unusable. Warnings name entries that the 2017 simulator silently ignored, such as an unknown
    option. With `--json`: `ok`, `errors`, `warnings`, and under `resolved` the values of every part, sensor and order,
    the arm and the options.

    A robot is a robot configuration (`vr_configs.yml`) or a URDF: `resolved` is what `cellwright robot --json` prints.
    Behind a xacro file, `NAME:=VALUE` gives an argument.

    With `--map`, everything in the cell is drawn with its name: bins, belts and their direction, trays, AGVs and their
    paths, views of logical cameras, parts, and what is out of reach of the arm.

    Exit status: 0 when the files can be used, 2 when they cannot.
    """
    if map_file is not None:
        options.writable_file("--map", map_file)
    try:
        given = [word for word in files if options.XACRO_MARK in word]
        paths = _paths([word for word in files if word not in given])
        report = check_files(paths, options.overrides(overrides), options.xacro_arguments(given))
        if report.trial is not None:  # the engine judges some files of models
            faults = (*arm_problems(report.trial), *robot_problems(report.trial))
            report = replace(
                report,
                errors=(*model_problems(report.trial), *(str(each.at(report.places, "error")) for each in faults)),
                warnings=(*report.warnings, *map(str, cell_warnings(report.trial, report.places))),
            )
    except CellwrightError as error:  # a missing file is a finding as well
        report = Report(errors=(str(error),))
    if map_file is not None and report.ok:
        _draw(report, map_file)
    if as_json:
        typer.echo(json.dumps(report.as_dict(), indent=2, sort_keys=True))
    else:
        for line in report.lines():
            echo(line)
    raise typer.Exit(DONE if report.ok else BAD_INPUT)


def _draw(report: Report, file: Path) -> None:
    """Write the map of a trial's cell."""
    if report.trial is None:
        raise UsageError(f"--map {file}: only a trial has a cell; give the files of one")
    from cellwright.viewer.cell_map import draw_map  # slow to load

    draw_map(report.trial, file)


def _paths(files: list[str]) -> list[Path]:
    """Return the paths to check: a robot's by name or folder, else those of a trial."""
    if len(files) == 1:
        with suppress(CellwrightError):
            return [find_robot(files[0])]
    return options.paths(files)
