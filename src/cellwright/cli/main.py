"""The command `cellwright`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Annotated

import typer

import cellwright
from cellwright.cli.commands import CommandsOnDemand
from cellwright.cli.exit_status import BAD_INPUT, NOT_DONE
from cellwright.util.errors import CellwrightError

_INTERRUPTED = 130  # what Typer returns for Ctrl-C

app = typer.Typer(
    name="cellwright",
    cls=CommandsOnDemand,
    help="""Simulates industrial robot cells, and judges the programs that work them.

    A cell, its orders and its faults are written in a YAML file, in the format of the ARIAC competition of 2017. A
    program works the cell; the referee says what it earned. Begin with:

        cellwright run lesson        # a trial that comes along, and its score
        cellwright run --help        # your own program, pictures, servos, JSON
        cellwright trials            # what else comes along
        cellwright eval lesson       # many runs, each judged, and a report
        cellwright serve lesson      # for programs in other processes
        cellwright plot run.mcap     # a figure of what was recorded
        cellwright view lesson       # see a trial, a robot, a recording, what is served
        cellwright check trial.yaml  # is this file sound?
        cellwright teleop qinglong   # a robot's controller node
        cellwright robot qinglong    # a robot's joints, by index
        cellwright operate --help    # drive a robot's controller node
        cellwright replay run.mcap   # what was recorded, looked at and played""",
    epilog="Exit status: 0 done; 1 not done; 2 bad input, and nothing was started.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(wanted: bool) -> None:  # noqa: FBT001
    if wanted:
        typer.echo(f"cellwright {cellwright.__version__}")
        raise typer.Exit


@app.callback()
def _options(
    _: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, metavar="", help="Show the version and exit."),
    ] = False,
) -> None:
    pass


def main(arguments: Sequence[str] | None = None, command_line: typer.Typer = app, *, name: str = "cellwright") -> int:
    """Run the command line; errors in the input are one line each on stderr.

    Args:
        arguments: what follows the command's name; None takes those of the process.
        command_line: the commands.
        name: name of the program in its help.

    Returns:
        The exit status.
    """
    try:
        status = command_line(arguments, prog_name=name, standalone_mode=False)
    except CellwrightError as error:
        for line in str(error).splitlines():
            sys.stderr.write(f"error: {line}\n")
        return BAD_INPUT
    except typer.TyperException as error:
        message = error.format_message()
        if message:
            sys.stderr.write(f"error: {message} ({name} --help tells what there is)\n")
        return BAD_INPUT
    except typer.Abort:
        status = _INTERRUPTED
    if status == _INTERRUPTED:
        sys.stderr.write("interrupted\n")
        return NOT_DONE
    return int(status or 0)
