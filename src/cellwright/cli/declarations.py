"""Declarations of command-line arguments, options and flags, for `Annotated` types of Typer."""

from __future__ import annotations

from typing import Any

import typer


def argument(metavar: str, text: str) -> Any:
    """A positional argument."""
    return typer.Argument(metavar=metavar, help=text, show_default=False)


def option(metavar: str, text: str, panel: str | None = None, name: str | None = None) -> Any:
    """An option that takes a value; without a `name`, such as `--video`, it has that of the parameter."""
    return typer.Option(*([name] if name else []), metavar=metavar, help=text, rich_help_panel=panel)


def flag(names: str, text: str, panel: str | None = None) -> Any:
    """An option without a value; names are separated by spaces, such as `--development-mode -d`."""
    return typer.Option(*names.split(), metavar="", help=text, rich_help_panel=panel)
