"""Launcher `gear.py` of 2017: its command line, the files it leaves, the log of a trial, and the cell it starts.

config.yaml   the configuration as it was given, files joined
gear.yaml     the resolved configuration: every part, sensor, order and drop region with its figures
gear.urdf     the robot description
gear.launch   starts the same cell again: `roslaunch DIR/gear.launch`

The log is `~/.ariac/log/performance.log`: a line for each event, and the score in a block at the end, which scripts of
2017 look for. Times are simulation time [s].
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import Any

import yaml
from rich.console import Console

from cellwright.cell.cell import Cell
from cellwright.cell.interface.parameters import robot_description
from cellwright.cell.kitting import effects
from cellwright.cell.kitting.kit_score import KitScore
from cellwright.cell.kitting.scorer import GameScore, OrderScore
from cellwright.cli.options import default_speed
from cellwright.cli.output import print_line
from cellwright.cli.serve import EXIT_ON_COMPLETION, run_served, served_session
from cellwright.config.parsing.sources import read_texts
from cellwright.config.sensors import PictureCameraConfig, SensorConfig
from cellwright.config.trial.gear2017 import Loaded, load_trial, resolved
from cellwright.engine.clock import seconds
from cellwright.engine.rate_control import RateControl
from cellwright.running.run import CellTarget, RunOptions, ServerOptions
from cellwright.util.errors import CellwrightError, UsageError, printable
from cellwright.util.files import LineFile, write_atomic

OUTPUT = Path("/tmp/ariac")  # noqa: S108 - where the original put its files, and programs look for them
"""Folder for the files that describe the started cell."""
COMPETITION = "ARIAC_COMPETITION"
"""Environment variable: with any value the cell is in competition mode."""
_REMAPPING = ":="
CONFIG = "config.yaml"
_LAUNCH = """\
<?xml version="1.0"?>
<!-- The cell as gear.py started it. -->
<launch>
  <node name="ariac_node" pkg="osrf_gear" type="gear.py" output="screen" required="true"
        args="{options}-f $(dirname)/{config}" />
</launch>
"""
_FAILED = 1


def log_path(home: Path) -> Path:
    """Return the path of a user's log."""
    return home / ".ariac" / "log" / "performance.log"


class PerformanceLog:
    """Log of one trial. Each line is flushed to the operating system at once.

    If the file cannot be written, that is reported once, and the cell goes on without it.

    Args:
        path: the file; its old content is removed.
        report: receives a line if the file cannot be written.
    """

    def __init__(self, path: Path, report: Callable[[str], None]) -> None:
        self.path = path
        self._has_score = False
        self._file: LineFile | None = None
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            # The original left a link, which may be dangling by now.
            if path.is_symlink():
                path.unlink()
            self._file = LineFile(path, report=report)
        except OSError as error:
            report(f"{path}: score log cannot be written: {error.strerror or error}")

    def effect(self, effect: effects.Effect, now: int) -> None:
        """Log an action of the referee at the time `now` [ns]."""
        for line in _lines(effect):
            self._write(f"[{seconds(now):.3f}] {line}")
        if isinstance(effect, effects.TrialEnded):
            self.score(effect.score, effect.process_time)

    def score(self, score: GameScore, process_time: int) -> None:
        """Write the score and the duration of the game [ns], unless they are written already."""
        if not self._has_score:
            self._has_score = True
            self._write("\n".join(score_lines(score, process_time)))

    def close(self) -> None:
        """Close the log."""
        if self._file is not None:
            self._file.close()

    def _write(self, text: str) -> None:
        if self._file is not None:
            self._file.write(text)


def _lines(effect: effects.Effect) -> Iterator[str]:
    match effect:
        case effects.StateChanged(state):
            yield f"State: {state}"
        case effects.OrderAnnounced(order, reason, _):
            yield f"Announcing order: {order.order_id} ({reason})"
        case effects.KitSubmitted(tray_id, kit_type, score, _):
            yield f"Submitted tray: {tray_id} as {kit_type}: [{score.total:g}]"
            if score.refusal is not None:
                yield score.refusal.sentence()
        case effects.OrderCompleted(score, _):
            yield f"Order complete: {score.order_id}: [{score.total:g}]"
        case effects.TrialEnded(reason, _, _):
            yield f"Trial over: {reason}"


def score_lines(score: GameScore, process_time: int) -> Iterator[str]:
    """Yield the block of the score: the game, its duration [ns], its orders, their kits."""
    yield "<game_score>"
    yield f"Total game score: [{score.total:g}]"
    yield f"Total process time: [{seconds(process_time):.3f}]"
    yield f"Part travel time: [{seconds(score.part_travel_time):.3f}]"
    for order in score.orders:
        yield from _order_lines(order)
    yield "</game_score>"


def _order_lines(order: OrderScore) -> Iterator[str]:
    yield f"<order_score {order.order_id}>"
    yield f"Total order score: [{order.total:g}]"
    yield f"Time taken: [{seconds(order.time_taken):.3f}]"
    yield f"Complete: [{_word(order.is_complete)}]"
    for kit in order.kits:
        yield from _kit_lines(kit)
    yield "</order_score>"


def _kit_lines(kit: KitScore) -> Iterator[str]:
    yield f"<kit_score {kit.kit_type}>"
    yield f"Total kit score: [{kit.total:g}]"
    yield f"Complete: [{_word(kit.is_complete)}]"
    yield f"Submitted: [{_word(kit.is_submitted)}]"
    yield f"Part presence score: [{kit.part_presence:g}]"
    yield f"All parts bonus: [{kit.all_parts_bonus:g}]"
    yield f"Part pose score: [{kit.part_pose:g}]"
    yield "</kit_score>"


def _word(truth: bool) -> str:  # noqa: FBT001
    return "true" if truth else "false"


def without_remappings(arguments: Sequence[str]) -> list[str]:
    """Return the program's own arguments: `roslaunch` adds remappings, such as `__name:=ariac_node`."""
    return [argument for argument in arguments if _REMAPPING not in argument]


def parse(arguments: Sequence[str], variables: Mapping[str, str]) -> argparse.Namespace:
    """Read the command line; an error ends the program with status 2 and a line on its usage."""
    parsed = _parser().parse_args(without_remappings(arguments))
    parsed.file = parsed.file or []
    parsed.competition = not parsed.development_mode or COMPETITION in variables
    return parsed


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="gear.py",
        description="Start the kit-building cell, and a roscore if none is running, until Ctrl-C.",
        epilog="Cellwright simulates the cell; see also: cellwright serve --help",
    )
    source = parser.add_mutually_exclusive_group()
    source.add_argument("config", nargs="?", default="", metavar="CONFIG", help="configuration as YAML text")
    source.add_argument(
        "-f", "--file", nargs="+", action="extend", metavar="F", help="configuration files, joined into one"
    )
    parser.add_argument("-n", "--dry-run", action="store_true", help="print the launch files; write and start nothing")
    parser.add_argument("-v", "--verbose", action="store_true", help="print the resolved configuration too")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        default=OUTPUT,
        metavar="DIR",
        help="folder for configuration, robot description and launch file (default: %(default)s)",
    )
    parser.add_argument(
        "-d",
        "--development-mode",
        action="store_true",
        help="allow what a competition refuses, such as the belt's power",
    )
    parser.add_argument("--no-gui", action="store_true", help="accepted for old scripts, without effect")
    return parser


def launch_files(loaded: Loaded, text: str, *, competition: bool, verbose: bool = False) -> dict[str, str]:
    """Return the content of each file by its name."""
    options = ("" if competition else "--development-mode ") + ("--verbose " if verbose else "")
    return {
        CONFIG: text,
        "gear.yaml": resolved_text(loaded),
        "gear.urdf": robot_description(loaded.trial),
        "gear.launch": _LAUNCH.format(options=options, config=CONFIG),
    }


def resolved_text(loaded: Loaded) -> str:
    """Return the resolved configuration as YAML; poses in m and rad."""
    trial = loaded.trial
    facts: dict[str, Any] = {
        "name": trial.name,
        "arm": trial.has_arm,
        "sensors": {
            sensor.name: _sensor(sensor) for sensor in trial.sensors if not isinstance(sensor, PictureCameraConfig)
        },
        **resolved(loaded),
    }
    return yaml.safe_dump(facts, sort_keys=False, allow_unicode=True, default_flow_style=None, width=120)


def _sensor(sensor: SensorConfig) -> dict[str, Any]:
    xyz, rpy = ([float(value) for value in vector] for vector in (sensor.pose.position, sensor.pose.rpy))
    return {"type": sensor.type, "xyz": xyz, "rpy": rpy}


def write_launch_files(files: dict[str, str], folder: Path) -> None:
    """Write the files."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            write_atomic(folder / name, content)
    except OSError as error:
        raise UsageError(f"{folder}: cannot be written: {error.strerror or error}") from None


def main(arguments: Sequence[str], variables: Mapping[str, str] = os.environ) -> int:
    """Start the cell, and stay until it ends; return the exit status, 1 for any error."""
    options = parse(arguments, variables)
    try:
        return _launch(options, variables)
    except CellwrightError as error:
        for line in str(error).splitlines():
            sys.stderr.write(f"Error: {printable(line)}\n")
        return _FAILED


def _launch(options: argparse.Namespace, variables: Mapping[str, str]) -> int:
    speed = default_speed(variables)
    text, loaded = _load(options)
    for warning in loaded.warnings:
        _warn(str(warning))
    files = launch_files(loaded, text, competition=options.competition, verbose=options.verbose)
    if options.dry_run:
        for name, content in files.items():
            sys.stdout.write(f"# file: {name}\n{content.rstrip()}\n\n")
        return 0
    try:
        write_launch_files(files, options.output)
    except UsageError as error:
        _warn(str(error))
    if options.verbose:
        sys.stdout.write(files["gear.yaml"])
        sys.stdout.flush()
    return _serve(loaded, options, variables, speed)


def _load(options: argparse.Namespace) -> tuple[str, Loaded]:
    """Return the configuration as given, and the cell it describes. An empty one is a cell without arm and sensors."""
    if not options.file:
        return options.config, load_trial(text=options.config)
    paths = _without_devel_folders([Path(file) for file in options.file])
    return read_texts(paths).content, load_trial(paths)


def _without_devel_folders(paths: Sequence[Path]) -> list[Path]:
    """Return the paths without the build folders that `catkin_find --share PACKAGE` prints before the sources.

    In a workspace it prints two lines, and a shell makes two words of
    ``-f `catkin_find --share osrf_gear`/config/sample.yaml``. The first is a folder of catkin's own files.
    """
    kept = []
    for path, following in zip_longest(paths, paths[1:]):
        is_devel = path.parent.name == "share" and (path / "cmake").is_dir() and following is not None
        if is_devel and path.name in following.parts:
            _warn(f"{path}: catkin's build folder of {path.name} has no configuration; going on with {following}")
        else:
            kept.append(path)
    return kept


def _serve(loaded: Loaded, given: argparse.Namespace, variables: Mapping[str, str], speed: float | None) -> int:
    log = PerformanceLog(log_path(Path.home()), _warn)
    console = Console(highlight=False)
    cell: list[Cell] = []

    def make() -> Cell:
        report = partial(print_line, console, style="yellow")
        cell.append(Cell(loaded.trial, competition=given.competition, report=report))
        competition, simulation = cell[0].competition, cell[0].simulation
        competition.on_effect.append(lambda effect: log.effect(effect, simulation.now))
        return cell[0]

    session = served_session(
        CellTarget(make),
        console,
        rate=RateControl(speed),
        serve=ServerOptions(port=0, ros1=True),
        options=RunOptions(ends_when_done=EXIT_ON_COMPLETION in variables),
    )
    try:
        return run_served(session, console, verbose=given.verbose)
    finally:
        for each in cell:
            log.score(each.competition.score(), each.competition.process_time)
        log.close()


def _warn(text: str) -> None:
    sys.stderr.write(f"Warning: {printable(text)}\n")
