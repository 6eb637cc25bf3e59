"""What the commands have in common: files, and the refusal of what cannot be used."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Annotated, NoReturn, TypeVar, get_args

import typer

from cellwright.cell import Cell
from cellwright.description.catalogue import find_trial
from cellwright.description.gear2017 import load_trial
from cellwright.description.trial import ServoProfile, Trial
from cellwright.errors import UnknownNameError, UsageError

BAD_INPUT = 2
"""Exit status for input that cannot be used; nothing has been started."""

Files = Annotated[
    list[str],
    typer.Argument(
        metavar="TRIAL...",
        help="A trial that comes with Cellwright (`lesson`), or the files of one, joined as the original joins them.",
    ),
]

T = TypeVar("T")


def refuse(message: str) -> NoReturn:
    """Say why the input cannot be used, and stop."""
    raise UsageError(message)


def paths(files: list[str]) -> list[Path]:
    """The paths of a trial's files; names of bundled trials are looked up."""
    return [find_trial(file) for file in files]


def load(files: list[str]) -> Trial:
    """The trial in these files; warnings are printed.

    Raises:
        DescriptionError: the files cannot be used.
    """
    loaded = load_trial(paths(files))
    for warning in loaded.warnings:
        typer.echo(f"warning: {warning}", err=True)
    return loaded.trial


def snapshot(text: str) -> tuple[Fraction, Path]:
    """What `T:FILE.png` says: a simulation time [s] and a file."""
    time, colon, file = text.partition(":")
    try:
        when = Fraction(time)
    except (ValueError, ZeroDivisionError):
        when = Fraction(-1)
    if not colon or when < 0 or not file.lower().endswith(".png"):
        refuse(f"--snapshot {text}: give a time in seconds and a file, such as 12.5:picked.png")
    if not Path(file).resolve().parent.is_dir():
        refuse(f"--snapshot {text}: there is no folder {Path(file).parent}")
    return when, Path(file)


def attempt(make: Callable[[], T], option: str) -> T:
    """What `make` returns; an unknown name is said with the option that it was given to."""
    try:
        return make()
    except UnknownNameError as error:
        refuse(f"{option}: {error.sentence()}")


def servo(name: str | None) -> ServoProfile | None:
    """The servo profile of this name; None for None."""
    for profile in get_args(ServoProfile):
        if profile == name:
            found: ServoProfile = profile
            return found
    if name is not None:
        refuse(f"--servo: {UnknownNameError('servo profile', name, get_args(ServoProfile)).sentence()}")
    return None


def topics(names: Sequence[str], cell: Cell) -> None:
    """Refuse names of topics that the cell does not have; `all` stands for all of them."""
    for name in names:
        if name != "all":
            attempt(lambda name=name: cell.bus.topic(name), "--listen")  # type: ignore[misc]
