"""Declarations of options for Typer: their help and the heading under which it is listed."""

from __future__ import annotations

from typing import Any

import typer


def option(help: str, panel: str | None = None, metavar: str | None = None, *names: str) -> Any:  # noqa: A002
    """An option with a value.

    Args:
        help: what it does.
        panel: heading in the help.
        metavar: what stands for the value in the help; None: its type.
        names: such as `--agent` and `-a`; none: after the parameter.
    """
    return typer.Option(*names, metavar=metavar, help=help, rich_help_panel=panel)


def flag(help: str, panel: str | None = None, *names: str) -> Any:  # noqa: A002
    """An option without a value, as of `option`."""
    return typer.Option(*names, metavar="", help=help, rich_help_panel=panel)
