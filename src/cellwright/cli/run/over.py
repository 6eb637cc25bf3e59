"""`cellwright run` with the agent and the cell in different processes."""

from __future__ import annotations

import json
import logging
import sys
from collections.abc import Callable
from contextlib import ExitStack
from typing import NoReturn

import typer
from rich.console import Console

from cellwright.agents.agent import find_agent
from cellwright.cell import Cell
from cellwright.cli import options
from cellwright.cli.exit_status import DONE, NOT_DONE
from cellwright.cli.run.attended import Attended
from cellwright.cli.serve.result import RESULT
from cellwright.cli.signals import stopped_by_signals
from cellwright.client.client import Client
from cellwright.client.transports.socket import SocketTransport
from cellwright.errors import UsageError
from cellwright.remote.hosting import NODE, Host
from cellwright.remote.working import Parting, Worked, work
from cellwright.ros1_host import Ros1
from cellwright.run import DRIVE, RunOptions, RunResult

Report = Callable[[str], None]

_STATE = "/ariac/competition_state"  # what every cell tells of

WAYS = ("socket", "ros1")
"""Ways between an agent and a cell that are in different processes."""


def way(over: str | None, *, lockstep: bool) -> str | None:
    """The way between agent and cell; None within one process."""
    if over is None and lockstep:
        options.refuse(f"--lockstep: say over what as well, such as --over {WAYS[0]}; in one process it is always so")
    if over is not None and over not in WAYS:
        options.refuse(f"--over {over}: give {' or '.join(WAYS)}")
    return over


def hosted(
    cell: Cell,
    agent: str,
    wanted: RunOptions,
    *,
    way: str,
    lockstep: bool,
    verbose: bool,
    report: Report,
    attended: Attended | None = None,
) -> RunResult:
    """Run a cell whose agent works in a process of its own.

    Args:
        cell: the cell.
        agent: the agent's name.
        wanted: what the run is told besides.
        way: how the agent comes to the cell, one of `WAYS`.
        lockstep: whether time passes only while the agent waits.
        verbose: whether to tell what the agent logs at level INFO.
        report: takes a line about what goes wrong in ROS.
        attended: who looks on; None for nobody.
    """
    host = Host(cell, agent, lockstep=lockstep, level=logging.INFO if verbose else logging.WARNING, say=_say)
    if attended is not None:
        host.server, host.tempo = attended.server, attended.tempo
    with stopped_by_signals(host.interrupt), ExitStack() as to_close:
        if way == "ros1":
            host.ros = to_close.enter_context(Ros1(report, lambda: host.is_interrupted))
            host.ros.prepare()
        return host.run(wanted)


def connected(agent: str, address: str, *, as_json: bool, min_score: float | None) -> NoReturn:
    """Let an agent work, in this process, a cell that is served already; print what the cell says of it."""
    where = options.address("--connect", address)
    console = Console(stderr=as_json, highlight=False)
    worker = find_agent(agent)()
    transport = SocketTransport(where, node=NODE)
    if not any(each["name"] == _STATE for each in transport.welcome["topics"]):
        transport.close()
        options.refuse(
            f"--connect {address}: no cell is served there, but {transport.welcome['trial']}, a robot's node"
        )
    console.print(f"trial {transport.welcome['trial']}, agent {agent}, at {address}", markup=False, soft_wrap=True)
    worked = work(worker, transport, _wait_for_kits)
    sys.stderr.write(worked.error)
    try:
        asking = SocketTransport(where, node=NODE)
    except UsageError:
        typer.echo("the cell is gone; where it was served its score has been printed", err=True)
        raise typer.Exit(NOT_DONE) from None
    result = asking.ask_server(RESULT)
    asking.close()
    document = result["document"]
    score = document["score"]["total"]
    enough = min_score is None or score >= min_score
    status = DONE if document["competition_state"] == "done" and _is_well(worked) and enough else NOT_DONE
    if as_json:
        typer.echo(json.dumps(document | {"agent": agent, "error": worked.error, "exit_status": status}, indent=2))
    else:
        typer.echo(result["text"], nl=False)
        if not enough:
            console.print(f"not enough  {min_score:g} points were asked for", markup=False)
    raise typer.Exit(status)


def _is_well(worked: Worked) -> bool:
    return worked.parting in (Parting.RETURNED, Parting.RUN_ENDED)


def _wait_for_kits(client: Client) -> None:
    """The agent has returned; kits that it sent off still arrive, and the competition may still end."""
    agvs = [client.latest(f"/ariac/agv{number}/state") for number in (1, 2)]
    client.sleep(0.2)  # by then all states have been told

    def nothing_to_come() -> bool:
        on_their_way = [agv.message is not None and agv.message.data == "preparing_to_deliver" for agv in agvs]
        return client.competition_state == "done" or not any(on_their_way)

    client.wait_until(nothing_to_come, DRIVE)
    client.wait_until(lambda: client.competition_state == "done", 0.3)


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
