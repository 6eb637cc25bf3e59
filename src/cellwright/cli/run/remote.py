"""Agent and cell in different processes: `cellwright run --over` and `cellwright run --connect`."""

from __future__ import annotations

import json
import logging
import sys
from collections.abc import Callable
from contextlib import ExitStack
from typing import NoReturn

import typer
from rich.console import Console

from cellwright.cell.cell import Cell
from cellwright.cli import options
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.page import ViewedRun
from cellwright.cli.serve import RESULT
from cellwright.cli.signals import stopped_by_signals
from cellwright.clients.agents.agent import find_agent
from cellwright.clients.client.client import Client
from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.middleware.ros1.host import Ros1
from cellwright.running.remote.hosting import NODE, Host
from cellwright.running.remote.program import AgentExit, Parting, run_agent
from cellwright.running.run import DRIVE, RunOptions, RunResult
from cellwright.util.errors import UsageError

Report = Callable[[str], None]


def run_hosted(
    cell: Cell,
    agent: str,
    wanted: RunOptions,
    *,
    way: str,
    lockstep: bool,
    verbose: bool,
    report: Report,
    attended: ViewedRun | None = None,
) -> RunResult:
    """Run a cell whose agent works in a process of its own.

    Args:
        cell: the cell.
        agent: the agent's name.
        wanted: what the run is told besides.
        way: how the agent comes to the cell, one of `over.WAYS`.
        lockstep: whether time passes only while the agent waits.
        verbose: whether to tell what the agent logs at level INFO.
        report: takes a line about what goes wrong in ROS.
        attended: who looks on; None for nobody.
    """
    host = Host(
        cell, agent, lockstep=lockstep, level=logging.INFO if verbose else logging.WARNING, say=_print_agent_line
    )
    if attended is not None:
        host.server, host.tempo = attended.server, attended.tempo
    with stopped_by_signals(host.interrupt), ExitStack() as to_close:
        if way == "ros1":
            host.ros = to_close.enter_context(Ros1(report, lambda: host.is_interrupted))
            host.ros.prepare()
        return host.run(wanted)


def _print_agent_line(line: str) -> None:
    sys.stdout.write(f"{line}\n")


_STATE = "/ariac/competition_state"  # what every cell tells of


def run_connected(agent: str, address: str, *, as_json: bool, min_score: float | None) -> NoReturn:
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
    worked = run_agent(worker, transport, _wait_for_kits_over_topics)
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
    status = DONE if document["competition_state"] == "done" and _ended_well(worked) and enough else NOT_DONE
    if as_json:
        typer.echo(json.dumps(document | {"agent": agent, "error": worked.error, "exit_status": status}, indent=2))
    else:
        typer.echo(result["text"], nl=False)
        if not enough:
            console.print(f"not enough  {min_score:g} points were asked for", markup=False)
    raise typer.Exit(status)


def _ended_well(worked: AgentExit) -> bool:
    return worked.parting in (Parting.RETURNED, Parting.RUN_ENDED)


def _wait_for_kits_over_topics(client: Client) -> None:
    """The agent has returned; kits that it sent off still arrive, and the competition may still end."""
    agvs = [client.latest(f"/ariac/agv{number}/state") for number in (1, 2)]
    client.sleep(0.2)  # by then all states have been told

    def nothing_to_come() -> bool:
        on_their_way = [agv.message is not None and agv.message.data == "preparing_to_deliver" for agv in agvs]
        return client.competition_state == "done" or not any(on_their_way)

    client.wait_until(nothing_to_come, DRIVE)
    client.wait_until(lambda: client.competition_state == "done", 0.3)
