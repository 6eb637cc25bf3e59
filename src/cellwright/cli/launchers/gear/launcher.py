"""`gear.py`: the launcher of 2017, as a launch file, a shell or a script of the time starts it."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from cellwright.cell.cell import Cell
from cellwright.cli.launchers.gear import generated
from cellwright.cli.launchers.gear.arguments import Arguments, parse
from cellwright.cli.launchers.gear.performance_log import PerformanceLog, log_path
from cellwright.cli.options import default_speed
from cellwright.cli.serve.trial import EXIT_ON_COMPLETION, ServeOptions, serve_trial
from cellwright.config.parsing.texts import read_texts
from cellwright.config.trial.gear2017 import Loaded, load_trial
from cellwright.util.errors import CellwrightError, UsageError

_FAILED = 1


def main(arguments: Sequence[str], variables: Mapping[str, str] = os.environ) -> int:
    """Start the cell, and stay until it ends.

    Args:
        arguments: those of the process, without the program's name.
        variables: those of its environment.

    Returns:
        The exit status: 1 for whatever is wrong with the configuration, or could not be started.
    """
    wanted = parse(arguments, variables)
    try:
        return _launch(wanted, variables)
    except CellwrightError as error:
        for line in str(error).splitlines():
            sys.stderr.write(f"Error: {line}\n")
        return _FAILED


def _launch(wanted: Arguments, variables: Mapping[str, str]) -> int:
    speed = default_speed(variables)
    text, loaded = _load(wanted)
    for warning in loaded.warnings:
        _warn(str(warning))
    files = generated.generated(loaded, text, competition=wanted.competition, verbose=wanted.verbose)
    if wanted.dry_run:
        for name, content in files.items():
            sys.stdout.write(f"# file: {name}\n{content.rstrip()}\n\n")
        return 0
    try:
        generated.write(files, wanted.output)
    except UsageError as error:
        _warn(str(error))
    if wanted.verbose:
        sys.stdout.write(files["gear.yaml"])
        sys.stdout.flush()
    return _serve(loaded, wanted, variables, speed)


def _load(wanted: Arguments) -> tuple[str, Loaded]:
    """The configuration as it was given, and what it says. Nothing at all is a cell without arm and sensors."""
    if not wanted.files:
        return wanted.config, load_trial(text=wanted.config)
    paths = [Path(file) for file in wanted.files]
    return read_texts(paths).content, load_trial(paths)


def _serve(loaded: Loaded, wanted: Arguments, variables: Mapping[str, str], speed: float | None) -> int:
    log = PerformanceLog(log_path(Path.home()), _warn)
    cells: list[Cell] = []

    def follow(cell: Cell) -> None:
        cells.append(cell)
        cell.competition.on_effect.append(lambda effect: log.effect(effect, cell.simulation.now))

    options = ServeOptions(
        competition=wanted.competition,
        ends_when_done=EXIT_ON_COMPLETION in variables,
        port=0,
        ros1=True,
        speed=speed,
        verbose=wanted.verbose,
    )
    try:
        return serve_trial(lambda: loaded.trial, options, follow)
    finally:
        for cell in cells:
            log.score(cell.competition.score(), cell.competition.process_time)
        log.close()


def _warn(text: str) -> None:
    sys.stderr.write(f"Warning: {text}\n")
