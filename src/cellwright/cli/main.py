"""The command `cellwright`."""

from __future__ import annotations

import sys
from importlib.metadata import version as installed_version
from typing import Annotated

import typer

from cellwright.cli.check import check
from cellwright.cli.run import run
from cellwright.errors import CellwrightError

app = typer.Typer(
    name="cellwright",
    help="""Simulates industrial robot cells, and judges the programs that work them.

    Begin with `cellwright run lesson`. A trial is a YAML file in the format of the 2017 ARIAC competition, or the name
    of one that comes with Cellwright.""",
    epilog="Exit status: 0 done; 1 not done (time limit, agent gave up or crashed, below --min-score); 2 bad input.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command()(run)
app.command()(check)


def _version(wanted: bool) -> None:  # noqa: FBT001
    if wanted:
        typer.echo(f"cellwright {installed_version('cellwright')}")
        raise typer.Exit


@app.callback()
def _options(
    _: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")] = False,
) -> None:
    pass


def main() -> None:
    """Run the command line. Errors in the input are one line each on stderr, and exit status 2."""
    try:
        app()
    except CellwrightError as error:
        sys.stderr.write(f"error: {error}\n")
        sys.exit(2)
