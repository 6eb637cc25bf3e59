"""Declarations of command-line arguments, options and flags, for `Annotated` types of Typer."""

from __future__ import annotations

from typing import Any

import typer


def argument(metavar: str, text: str) -> Any:
    """A positional argument.

    Args:
        metavar: its name in the help.
        text: its help.
    """
    return typer.Argument(metavar=metavar, help=text, show_default=False)


def option(metavar: str, text: str, panel: str | None = None, name: str | None = None) -> Any:
    """An option that takes a value.

    Args:
        metavar: name of the value in the help.
        text: its help.
        panel: the heading under which the help lists it; None: the general one.
        name: such as `--video`; None: that of the parameter.
    """
    return typer.Option(*([name] if name else []), metavar=metavar, help=text, rich_help_panel=panel)


def flag(names: str, text: str, panel: str | None = None) -> Any:
    """An option without a value.

    Args:
        names: separated by spaces, such as `--development-mode -d`.
        text: its help.
        panel: the heading under which the help lists it; None: the general one.
    """
    return typer.Option(*names.split(), metavar="", help=text, rich_help_panel=panel)
