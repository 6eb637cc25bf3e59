"""Process of an agent: `python -m cellwright.running.remote.program OVER HOST PORT NODE AGENT REPORT LEVEL`.

It connects over a socket to HOST and PORT, or to the cell in ROS 1, and lets the agent work. Then it writes to the file
REPORT how that ended, as JSON. It prints what the agent logs at LEVEL or above, with the simulation time.
"""

import faulthandler
import json
import logging
import sys
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from threading import get_ident

from cellwright.clients.agents.agent import Agent, find_agent
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import Transport
from cellwright.clients.client.ros1_transport import Ros1Transport
from cellwright.clients.client.ros2_transport import Ros2Transport
from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.middleware.ros1.host import installation
from cellwright.running.run import POLICY_FAULTS, agent_traceback, call_agent
from cellwright.util.errors import CellwrightError, RunEndedError
from cellwright.util.process import exit_despite_threads

REFUSED = "refused"
"""Key of a report instead of the agent's exit: the agent could not begin."""


class ExitReason(StrEnum):
    """Reason for which an agent left its cell."""

    RETURNED = "returned"
    RUN_ENDED = "run ended"
    CRASHED = "crashed"
    INFRASTRUCTURE = "infrastructure"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True, slots=True)
class AgentExit:
    """End of an agent's work: how it left its cell, and the error it failed with."""

    parting: ExitReason
    error: str = ""


def run_agent(
    agent: Agent, transport: Transport, afterwards: Callable[[Client], None] = lambda _client: None
) -> AgentExit:
    """Let an agent work a cell, and close its connection; this raises none of the agent's errors."""
    parting, error = ExitReason.RETURNED, ""
    try:
        client = Client(transport)
        call_agent(agent, client)
        afterwards(client)
    except RunEndedError:
        # The normal end of a program that works until it is stopped.
        parting = ExitReason.RUN_ENDED
    except KeyboardInterrupt:
        parting = ExitReason.INTERRUPTED
    except POLICY_FAULTS as fault:
        parting, error = ExitReason.INFRASTRUCTURE, f"{fault}\n"
    except BaseException as raised:  # whatever it is, it is reported
        parting, error = ExitReason.CRASHED, agent_traceback(raised, __file__)
    finally:
        transport.close()
    return AgentExit(parting, error)


def main(arguments: Sequence[str]) -> None:
    """Run the agent of the command line."""
    before = threading.enumerate()
    # An evaluation asks a program over its limit where it is.
    faulthandler.enable(sys.stdout)
    over, host, port, node, name, report, level = arguments
    try:
        agent = find_agent(name)()
        if over == "ros1":
            ros = installation.find()
            transport: SocketTransport = Ros1Transport(ros.python, node=node, environment=ros.environment)
        elif over == "ros2":
            from cellwright.middleware.ros2.host import installation as ros2

            found = ros2.find()
            transport = Ros2Transport(found.python, node=node, environment=found.environment)
        else:
            transport = SocketTransport((host, int(port)), node=node)
    except RunEndedError:  # the run was a short one
        document = {"parting": ExitReason.RUN_ENDED, "error": ""}
    except CellwrightError as error:
        document = {"parting": REFUSED, "error": str(error)}
    else:
        log = logging.getLogger()
        log.addHandler(_SimulationTimeHandler(transport))
        log.setLevel(int(level))
        agent_exit = run_agent(agent, transport)
        document = {"parting": agent_exit.parting, "error": agent_exit.error}
    sys.stdout.flush()
    Path(report).write_text(json.dumps(document), encoding="utf-8")
    exit_despite_threads(before, 0)


class _SimulationTimeHandler(logging.Handler):
    """Logging handler that prints records with the simulation time."""

    def __init__(self, transport: SocketTransport) -> None:
        super().__init__()
        self._transport = transport
        self._thread = get_ident()
        self._last_time = 0

    def emit(self, record: logging.LogRecord) -> None:
        for line in self.format(record).splitlines():
            sys.stdout.write(f"{self._now() / 1e9:9.3f} s  {line}\n")

    def _now(self) -> int:
        """Return the simulation time [ns]; only the agent's own thread may read it, others get the last one."""
        if get_ident() == self._thread:
            self._last_time = self._transport.now()
        return self._last_time


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except KeyboardInterrupt:
        sys.exit(130)
