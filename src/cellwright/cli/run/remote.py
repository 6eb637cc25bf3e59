"""Agent at a cell that another process serves: `cellwright run --connect`."""

import json
import sys
from collections.abc import Sequence
from functools import partial
from typing import NoReturn

import typer
from rich.console import Console

from cellwright.cli import options
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.serve import RESULT
from cellwright.clients.agents.agent import find_agent
from cellwright.clients.client.client import Client
from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.running.remote.hosting import NODE
from cellwright.running.remote.program import ExitReason, run_agent
from cellwright.running.run import DRIVE
from cellwright.util.errors import UsageError

_STATE = "/ariac/competition_state"  # every cell publishes it


def run_connected(agent: str, address: str, *, as_json: bool, min_score: float | None) -> NoReturn:
    """Let an agent in this process work a served cell; print the result that the cell reports."""
    server_address = options.address("--connect", address)
    console = Console(stderr=as_json, highlight=False)
    worker = find_agent(agent)()
    transport = SocketTransport(server_address, node=NODE)
    if not any(each["name"] == _STATE for each in transport.welcome["topics"]):
        transport.close()
        options.refuse(
            f"--connect {address}: serves {transport.welcome['trial']}, a robot's node; give the address of a cell"
        )
    console.print(f"trial {transport.welcome['trial']}, agent {agent}, at {address}", markup=False, soft_wrap=True)
    states = [
        each["name"]
        for each in transport.welcome["topics"]
        if each["name"].endswith("/state") and each["type"] == "std_msgs/String"
    ]
    ending = run_agent(worker, transport, partial(_wait_for_kits_over_topics, states))
    sys.stderr.write(ending.error)
    try:
        server = SocketTransport(server_address, node=NODE)
    except UsageError:
        typer.echo("the cell has ended; its server has printed the score", err=True)
        raise typer.Exit(NOT_DONE) from None
    result = server.ask_server(RESULT)
    server.close()
    document = result["document"]
    score = document["score"]["total"]
    enough = min_score is None or score >= min_score
    ended_well = ending.parting in (ExitReason.RETURNED, ExitReason.RUN_ENDED)
    success = document["success"]
    is_done = document["competition_state"] == "done" if success is None else success
    status = DONE if is_done and ended_well and enough else NOT_DONE
    if as_json:
        typer.echo(json.dumps(document | {"agent": agent, "error": ending.error, "exit_status": status}, indent=2))
    else:
        typer.echo(result["text"], nl=False)
        if not enough:
            console.print(f"not enough  below --min-score {min_score:g}", markup=False)
    raise typer.Exit(status)


def _wait_for_kits_over_topics(states: Sequence[str], client: Client) -> None:
    """Wait for kits on their way, by the states of AGVs and fixed trays; the competition may still end."""
    senders = [client.latest(topic) for topic in states]
    client.sleep(0.2)  # by then all states have arrived

    def nothing_to_come() -> bool:
        messages = [each.message for each in senders]
        on_their_way = [each is not None and each.data == "preparing_to_deliver" for each in messages]
        return client.competition_state == "done" or not any(on_their_way)

    client.wait_until(nothing_to_come, DRIVE)
    client.wait_until(lambda: client.competition_state == "done", 0.3)
