"""Host of a run whose agent works in a process of its own, and that process."""

import contextlib
import json
import logging
import os
import stat
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from io import TextIOWrapper
from pathlib import Path
from typing import IO

from cellwright.cell.kitting.effects import CompetitionState
from cellwright.clients.agents.agent import AgentError
from cellwright.clients.client.client import Client
from cellwright.running.remote.guarded import GuardedProcess
from cellwright.running.remote.program import REFUSED, AgentExit, ExitReason
from cellwright.running.run import Outcome, Program, Session, final_outcome, wait_for_kits
from cellwright.util.errors import RunEndedError, UsageError, printable
from cellwright.util.files import open_to_read
from cellwright.viewer.services import names

_LEAVE_TIMEOUT = 2.0
"""Time [s] that a process may take to end without a signal, and again after it got one."""

_KILL_TIMEOUT = 10.0
"""Time [s] that the guard may take to kill all that is left."""

_MAX_LINE = 1 << 16
"""Size limit of a line of output [characters]; a longer one is passed on in pieces."""

_MAX_REPORT = 1 << 20
"""Size limit of a report [bytes]; the agent may have written it."""

NODE = "/agent"
_POLL_PERIOD = 0.02  # [s]
_HAS_ENDED = "the agent's process has ended"
_EXIT_TIMEOUT = 60.0
"""Wall time [s] that an agent may go on after its run is over."""


class AgentProcess(GuardedProcess):
    """Runs an agent in a process of its own, which ends with this process or with its connection to the cell.

    Args:
        over: its connection to the cell, `socket`, `ros1` or `ros2`.
        level: log level from which on the agent's log lines are passed on.
        on_message: receives each line that the process prints, in another thread.
        environment: variables for the process, besides those of this one.
    """

    def __init__(
        self,
        agent: str,
        address: tuple[str, int],
        *,
        node: str,
        over: str = "socket",
        level: int,
        on_message: Callable[[str], None],
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="cellwright-", ignore_cleanup_errors=True)
        self._was_ended = False
        self._exit_report: AgentExit | str = ""
        self._report = Path(self._folder.name) / "report.json"
        command = [sys.executable, "-m", "cellwright.running.remote.program"]

        def pass_on(output: IO[bytes]) -> None:
            with TextIOWrapper(output, encoding="utf-8", errors="replace") as lines:
                for line in iter(lambda: lines.readline(_MAX_LINE), ""):
                    on_message(line.rstrip("\n"))

        super().__init__(
            [*command, over, address[0], str(address[1]), node, agent, str(self._report), str(level)],
            folder=self._folder.name,
            environment={**os.environ, **(environment or {}), "PYTHONUNBUFFERED": "1", "PYTHONIOENCODING": "utf-8"},
            stderr=subprocess.STDOUT,
            read=pass_on,
        )

    def end(self, timeout: float = _LEAVE_TIMEOUT) -> None:
        """Wait `timeout` [s] for the process to end; then end it."""
        if not self._ends_within(timeout):
            self._was_ended = True
            self._process.terminate()
            self._ends_within(_LEAVE_TIMEOUT)
        super().end(_KILL_TIMEOUT)
        self._exit_report = read_report(self._report)
        self._folder.cleanup()

    def agent_exit(self, *, has_connected: bool) -> AgentExit:
        """Return how the agent left its cell, after the process has ended.

        Args:
            has_connected: True if the agent had connected to its cell: then it was made, whatever its process reports.

        Raises:
            AgentError: there is no such agent, or it could not be made.
        """
        if isinstance(self._exit_report, AgentExit):
            return self._exit_report
        if self._exit_report and not has_connected:
            raise AgentError(self._exit_report)
        if self._was_ended:  # it did not notice that its run is over
            return AgentExit(ExitReason.RUN_ENDED)
        return AgentExit(ExitReason.CRASHED, f"the agent's process ended with status {self._process.returncode}\n")


def read_report(path: Path) -> AgentExit | str:
    """Return how the agent left its cell, or why it could not be made; empty for an invalid report."""
    with contextlib.suppress(OSError, ValueError, RecursionError), open_to_read(path) as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            return ""
        document = json.loads(file.read(_MAX_REPORT))
        if isinstance(document, dict) and isinstance(error := document.get("error"), str):
            if document.get("parting") == REFUSED:
                return printable(error) or "the agent could not be created"
            return AgentExit(ExitReason(str(document.get("parting"))), printable(error))
    return ""


class RemoteAgent(Program):
    """An agent in a process of its own, for the run of a session that serves clients.

    Example:
        ```python
        with Session("lesson", serve=ServerOptions(port=0, lockstep=True)) as session:
            result = session.run(RemoteAgent("my_robot.py:MyRobot"))
        ```

    Args:
        agent: the agent's name, as `find_agent` takes it.
        level: log level from which on the agent's log lines are passed on.
        on_message: receives each line that the agent prints, in another thread.
    """

    def __init__(self, agent: str, *, level: int = logging.WARNING, on_message: Callable[[str], None] = print) -> None:
        self.agent, self.level, self.on_message = agent, level, on_message

    def work(self, session: Session) -> tuple[Outcome, str]:
        """Let the agent work until the run is over; it connects over ROS if the session is a node there.

        Raises:
            AgentError: there is no such agent, or it could not be made.
            UsageError: the session serves no clients.
        """
        server = session.server
        if server is None:
            raise UsageError("agent: a RemoteAgent requires a session that serves clients; pass serve=True")
        if session.stop.is_requested:
            return Outcome.INTERRUPTED, ""
        assert session.serving is not None
        ros1, ros2 = session.serving.ros1, session.serving.ros2
        over, ros = ("ros1", ros1) if ros1 else ("ros2", ros2) if ros2 else ("socket", None)
        child = AgentProcess(
            self.agent,
            server.address,
            node=NODE,
            over=over,
            level=self.level,
            on_message=self.on_message,
            environment=None if ros is None else ros.for_programs,
        )
        has_connected = False

        def check_agent() -> None:
            nonlocal has_connected
            has_connected = has_connected or NODE in server.clients
            if not child.is_running:
                session.stop.request(_HAS_ENDED)

        session.on_poll.append(check_agent)
        session.loop.timeout = _EXIT_TIMEOUT
        try:
            # over a socket no time passes before the agent has connected
            while over == "socket" and child.is_running and not (has_connected or session.stop.is_requested):
                server.wait(_POLL_PERIOD)
                has_connected = NODE in server.clients
            session.loop.pacer.begin()
            outcome, error = session.state.pass_time()
        finally:
            session.on_poll.remove(check_agent)
            server.dismiss("the run is over", keep=names.is_viewer)
            child.end()
        return self._outcome(session, child, outcome, error, has_connected=has_connected)

    def _outcome(
        self, session: Session, child: AgentProcess, outcome: str, error: str, *, has_connected: bool
    ) -> tuple[Outcome, str]:
        cell, stop = session.node, session.stop
        if stop.is_requested:
            if stop.reason != _HAS_ENDED:
                return Outcome.INTERRUPTED, ""
            stop.withdraw()
        has_begun = cell.competition.state is not CompetitionState.INIT  # the agent's name in ROS 1 is unknown here
        ended = child.agent_exit(has_connected=has_connected or has_begun)
        if outcome == Outcome.UNSTABLE:
            return Outcome.UNSTABLE, error
        if ended.parting is ExitReason.CRASHED:
            return Outcome.CRASHED, ended.error
        if ended.parting is ExitReason.INFRASTRUCTURE:
            return Outcome.INFRASTRUCTURE, ended.error
        if ended.parting is ExitReason.RETURNED:
            client = Client(session.transport(NODE))
            with contextlib.suppress(RunEndedError), contextlib.closing(client):
                wait_for_kits(cell, client)
        is_stopped = cell.simulation.now >= stop.deadline
        return final_outcome(cell, otherwise=Outcome.UNTIL if is_stopped else Outcome.GAVE_UP), ""
