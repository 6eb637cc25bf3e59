"""An agent that works a cell from another process."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from cellwright.clients.agents.agent import Agent
from cellwright.clients.client.client import Client
from cellwright.clients.client.transports.transport import Transport
from cellwright.running.run import let_work, told
from cellwright.util.errors import RunEndedError


class Parting(StrEnum):
    """How an agent left its cell."""

    RETURNED = "returned"
    RUN_ENDED = "run ended"
    CRASHED = "crashed"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True, slots=True)
class Worked:
    """How an agent left its cell, and what it failed of."""

    parting: Parting
    error: str = ""


def work(agent: Agent, transport: Transport, afterwards: Callable[[Client], None] = lambda _client: None) -> Worked:
    """Let an agent work a cell; nothing that it raises comes out.

    Args:
        agent: what works.
        transport: its way to the cell; closed in the end.
        afterwards: what is still to be done once the agent has returned.
    """
    parting, error = Parting.RETURNED, ""
    try:
        client = Client(transport)
        let_work(agent, client)
        afterwards(client)
    except RunEndedError:
        parting = Parting.RUN_ENDED  # the ordinary end of a program that works until it is stopped
    except KeyboardInterrupt:
        parting = Parting.INTERRUPTED
    except BaseException as raised:  # whatever it is, it is told
        parting, error = Parting.CRASHED, told(raised, __file__)
    finally:
        transport.close()
    return Worked(parting, error)
