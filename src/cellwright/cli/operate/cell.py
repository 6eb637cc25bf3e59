"""Command `cellwright operate cell`: working the arms of a cell with the keys of a terminal."""

import sys
from contextlib import closing
from typing import Annotated

import typer
from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from cellwright.cli import options
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.operate.connection import NODE, Node
from cellwright.cli.output import echo
from cellwright.cli.parameters import option
from cellwright.clients.agents.operator.keys import HELP, CellKeys
from cellwright.clients.client.client import Client
from cellwright.clients.operators.terminal import TerminatedError
from cellwright.clients.operators.terminal import keyboard as terminal_keyboard
from cellwright.middleware.server import DEFAULT_PORT
from cellwright.middleware.server.server import LOOPBACK
from cellwright.util.errors import RunEndedError


def cell(
    connect: Annotated[
        str, option("HOST:PORT", "Address of the cell: the one that `run --operator` or `serve` prints.", "Connection")
    ] = f"{LOOPBACK}:{DEFAULT_PORT}",
    node: Node = NODE,
) -> None:
    """Work the arms of a cell with the keys of this terminal, through the agent operator.

    A press is a short motion along an axis of the world; a held key goes on. The screen lists the keys. The space bar
    stops all arms.

        cellwright run lesson --operator
        cellwright operate cell --connect 127.0.0.1:43211

    Exit status: 0 quit with Esc or Ctrl-C; 1 the run has ended, or a signal ended the process; 2 bad input, no operator
    in the cell, or no terminal.
    """
    if not sys.stdin.isatty() or not sys.stdout.isatty():
        options.refuse("the keyboard requires a terminal; without one publish on the topics /cellwright/operator/…")
    console, ended = Console(highlight=False), ""
    with closing(Client.connect(options.address("--connect", connect), node=node)) as client:
        keys = CellKeys(client)
        live = Live(console=console, screen=True, auto_refresh=False)
        try:
            with terminal_keyboard() as read, live:
                keys.run(read, lambda: live.update(_panel(keys), refresh=True))
        except KeyboardInterrupt:
            pass
        except (RunEndedError, TerminatedError) as error:
            ended = str(error)
    if ended:
        echo(f"error: {ended}", err=True)
    raise typer.Exit(NOT_DONE if ended else DONE)


def _panel(keys: CellKeys) -> Group:
    """Return the arms with their activities, the newest message and the keys."""
    report, arms = keys.report, Table.grid(padding=(0, 2))
    for number, (name, arm) in enumerate(report["arms"].items(), start=1):
        chosen = "▶" if name == report["arm"] else " "
        arms.add_row(chosen, str(number), Text(name, style="bold"), arm["mode"], Text(arm["why"], style="yellow"))
    table = Table.grid(padding=(0, 2))
    for key, does in HELP:
        table.add_row(Text(key, style="bold"), does)
    state = Text(" STOPPED ", style="bold white on red") if report["stopped"] else Text("")
    points = Text(f"{keys.client.competition_state}  {keys.client.score:g} points", style="dim")
    note = Text(report["note"] or keys.message, style="bold yellow")
    return Group(points, arms, state, note, table)
