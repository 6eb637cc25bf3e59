"""`cellwright check`: is a trial's file sound?"""

from __future__ import annotations

import json
import sys
from typing import Annotated

import typer

from cellwright.cli import options
from cellwright.description.check import check as check_files


def check(
    files: options.Files,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the findings, and what the file means, as JSON.")
    ] = False,
) -> None:
    """Check a trial's files: every warning and error with its line, and what the file comes to.

    Exit status 0 when they can be run, 2 when they cannot.
    """
    report = check_files(options.paths(files))
    if as_json:
        sys.stdout.write(json.dumps(report.as_dict(), indent=2, sort_keys=True) + "\n")
    else:
        for line in report.lines():
            typer.echo(line)
    raise typer.Exit(0 if report.ok else options.BAD_INPUT)
