"""The commands by name, each loaded when somebody asks for it: it takes a while, and the others are spared it."""

from __future__ import annotations

from collections.abc import Iterator, MutableMapping
from functools import cache
from importlib import import_module
from typing import Any

import typer
from typer.core import TyperGroup

from cellwright.util.loading import interrupts_end_the_process

_ROOM = "cellwright.cli"

COMMANDS = {
    "run": "run.command:run",
    "check": "check:check",
    "eval": "eval.command:evaluate",
    "serve": "serve.command:serve",
    "teleop": "teleop.command:teleop",
    "view": "view.command:view",
    "replay": "replay.command:replay",
    "plot": "plot.command:plot",
    "trials": "trials:trials",
    "robot": "robot.command:robot",
    "ros1-env": "ros1.env:ros1_env",
    "ros1-workspace": "ros1.workspace:ros1_workspace",
    "operate": "operate.app:app",
}
"""Where each is, below this room, in the order in which help lists them: a function, or an app of several commands."""


class CommandsOnDemand(TyperGroup):
    """A group of all of them."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands = _OnDemand()

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ARG002
        """Their names; none of them is loaded."""
        return [*self.commands]


class _OnDemand(MutableMapping[str, Any]):
    """Loads what is looked up. It is complete as it is, though the group's type is of one that grows."""

    def __getitem__(self, name: str) -> Any:
        return _loaded(name, COMMANDS[name])

    def __setitem__(self, name: str, command: Any) -> None:
        raise TypeError(f"{name}: commands stand in COMMANDS")

    def __delitem__(self, name: str) -> None:
        raise TypeError(f"{name}: commands stand in COMMANDS")

    def __iter__(self) -> Iterator[str]:
        return iter(COMMANDS)

    def __len__(self) -> int:
        return len(COMMANDS)


@cache
def _loaded(name: str, where: str) -> Any:
    module, _, attribute = where.partition(":")
    with interrupts_end_the_process():
        found = getattr(import_module(f"{_ROOM}.{module}"), attribute)
    if isinstance(found, typer.Typer):
        return typer.main.get_command(found)
    alone = typer.Typer(add_completion=False, rich_markup_mode="markdown", pretty_exceptions_enable=False)
    alone.command(name)(found)
    return typer.main.get_command(alone)
