"""Command `cellwright cell new`: a start of a cell of one's own."""

from importlib.resources import files
from pathlib import Path
from typing import Annotated

import typer

from cellwright.cli.options import refuse
from cellwright.cli.parameters import argument

_SUFFIXES = (".yaml", ".yml")


def new(file: Annotated[Path, argument("FILE", "The file to write.")] = Path("cell.yaml")) -> None:
    """Write a small cell with comments, which can be checked, drawn and run as it is.

    An existing file is never overwritten.
    """
    if file.suffix.lower() not in _SUFFIXES:
        refuse(f"{file}: give a file whose name ends in {_SUFFIXES[0]}")
    try:
        with file.open("xb") as written:
            written.write(start())
    except FileExistsError:
        refuse(f"{file}: exists already; give another name, or delete it")
    except OSError as error:
        refuse(f"{file}: cannot be written: {error.strerror}")
    typer.echo(f"written: {file}")


def start() -> bytes:
    """Return the text of a new cell."""
    return (files("cellwright.cli.cell") / "start.yaml").read_bytes()
