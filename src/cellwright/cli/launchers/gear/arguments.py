"""The command line of 2017's launcher."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

OUTPUT = Path("/tmp/ariac")  # noqa: S108 - where the original put its files, and programs look for them
"""Where the files go that say what is started."""

COMPETITION = "ARIAC_COMPETITION"
"""Environment variable: with any value the cell is in competition mode."""

_REMAPPING = ":="


@dataclass(frozen=True, slots=True)
class Arguments:
    """What the launcher was asked for.

    Attributes:
        config: the configuration itself, as YAML; empty if there is none.
        files: files that are read as one configuration.
        dry_run: show what would be started, and start nothing.
        verbose: say more.
        output: where the files go that say what is started.
        competition: whether what a competition refuses is refused.
    """

    config: str = ""
    files: tuple[str, ...] = ()
    dry_run: bool = False
    verbose: bool = False
    output: Path = OUTPUT
    competition: bool = True


def without_remappings(arguments: Sequence[str]) -> list[str]:
    """The arguments that are the program's own: `roslaunch` adds remappings, such as `__name:=ariac_node`."""
    return [argument for argument in arguments if _REMAPPING not in argument]


def parse(arguments: Sequence[str], variables: Mapping[str, str]) -> Arguments:
    """Read the command line; what cannot be read ends the program with status 2 and a line on how it is used.

    Args:
        arguments: those of the process, without the program's name.
        variables: those of its environment.
    """
    parsed = _parser().parse_args(without_remappings(arguments))
    return Arguments(
        config=parsed.config,
        files=tuple(parsed.file or ()),
        dry_run=parsed.dry_run,
        verbose=parsed.verbose,
        output=parsed.output,
        competition=not parsed.development_mode or COMPETITION in variables,
    )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="gear.py",
        description="Starts the kit-building cell, and a roscore if none runs; it ends with Ctrl-C.",
        epilog="Cellwright works the cell; see also: cellwright serve --help",
    )
    source = parser.add_mutually_exclusive_group()
    source.add_argument("config", nargs="?", default="", metavar="CONFIG", help="the configuration itself, as YAML")
    source.add_argument(
        "-f", "--file", nargs="+", action="extend", metavar="F", help="files that are read as one configuration"
    )
    parser.add_argument(
        "-n", "--dry-run", action="store_true", help="print what would be started, and write and start nothing"
    )
    parser.add_argument("-v", "--verbose", action="store_true", help="print the resolved configuration too")
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        default=OUTPUT,
        metavar="DIR",
        help="where configuration, robot description and launch file are written (default: %(default)s)",
    )
    parser.add_argument(
        "-d",
        "--development-mode",
        action="store_true",
        help="allow what a competition refuses, such as the belt's power",
    )
    parser.add_argument("--no-gui", action="store_true", help="taken for old scripts; there is no window to open")
    return parser
