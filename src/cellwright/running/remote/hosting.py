"""Host of a run whose agent works in a process of its own, and that process."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import stat
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import IO

from cellwright.cell.cell import Cell
from cellwright.cell.interface.parameters import parameters
from cellwright.cell.kitting.effects import CompetitionState
from cellwright.clients.agents.agent import AgentError
from cellwright.clients.client.client import Client
from cellwright.engine.rate_control import RateControl
from cellwright.middleware import wire as link
from cellwright.middleware.ros1.host import Ros1
from cellwright.middleware.server import Server
from cellwright.running.remote.program import REFUSED, AgentExit, Parting
from cellwright.running.run import Outcome, RunContext, RunOptions, RunResult, execute_run, how_it_ended, wait_for_kits
from cellwright.running.serving import Hooks, Serving
from cellwright.util.errors import RunEndedError, showable
from cellwright.util.files import open_to_read
from cellwright.viewer.services import names

_GUARD = Path(link.__file__).with_name("guard.py")

if sys.platform == "win32":
    _APART = subprocess.CREATE_NEW_PROCESS_GROUP
else:
    _APART = 0

_LEAVING = 2.0
"""So long [s] a process that is over may take to end by itself, and again when it is told to."""

_LONGEST_REPORT = 1 << 20
"""Bytes of a report that are read; the agent may have written it."""


class AgentProcess:
    """Runs an agent in a process of its own, which ends when this one does, or its connection to the cell.

    Args:
        agent: the agent's name.
        address: host and port of the cell.
        node: the agent's node name.
        way: how it comes to the cell, `socket` or `ros1`.
        level: what the agent logs from this level on is passed on.
        say: takes each line that the process prints; called from another thread.
        environment: what the process has in its environment besides that of this one.
    """

    def __init__(
        self,
        agent: str,
        address: tuple[str, int],
        *,
        node: str,
        way: str = "socket",
        level: int,
        say: Callable[[str], None],
        environment: Mapping[str, str] | None = None,
    ) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="cellwright-", ignore_cleanup_errors=True)
        self._was_ended = False
        self._said: AgentExit | None = None
        self._refusal = ""
        self._report = Path(self._folder.name) / "report.json"
        command = [sys.executable, "-m", "cellwright.running.remote.program"]
        if sys.platform == "linux":  # elsewhere it ends with its connection
            command = [sys.executable, "-I", "-S", str(_GUARD), self._folder.name, *command]
        # a session of its own: Ctrl-C is for the parent, which ends the run in good order
        self._process = subprocess.Popen(  # noqa: S603 - our own interpreter and module
            [*command, way, address[0], str(address[1]), node, agent, str(self._report), str(level)],
            stdin=subprocess.PIPE,  # its end ends all
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            encoding="utf-8",
            errors="replace",
            env={**os.environ, **(environment or {}), "PYTHONUNBUFFERED": "1", "PYTHONIOENCODING": "utf-8"},
            start_new_session=os.name == "posix",
            creationflags=_APART,
        )
        self._reader = threading.Thread(target=_pass_on, args=(self._process.stdout, say), daemon=True)
        self._reader.start()

    @property
    def is_running(self) -> bool:
        """Whether the process is still there."""
        return self._process.poll() is None

    def end(self, patience: float = _LEAVING) -> None:
        """Wait for the process, so long [s]; end it if need be."""
        process = self._process
        try:
            process.wait(patience)
        except subprocess.TimeoutExpired:
            self._was_ended = True
            process.terminate()
            try:
                process.wait(_LEAVING)
            except subprocess.TimeoutExpired:
                self._kill()
        self._reader.join(_LEAVING)
        report = read_report(self._report)
        if isinstance(report, AgentExit):
            self._said = report
        elif report:
            self._refusal = report
        if process.stdin is not None:
            process.stdin.close()
        self._folder.cleanup()

    def worked(self, *, was_there: bool) -> AgentExit:
        """How the agent left its cell, when the process has ended.

        Args:
            was_there: whether the agent has come to its cell: then it was made, whatever its process says.

        Raises:
            AgentError: there is no such agent, or it could not be made.
        """
        if self._refusal and not was_there:
            raise AgentError(self._refusal)
        if self._said is not None:
            return self._said
        if self._was_ended:  # it did not take note that its run is over
            return AgentExit(Parting.RUN_ENDED)
        return AgentExit(Parting.CRASHED, f"the agent's process ended with status {self._process.returncode}\n")

    def _kill(self) -> None:
        process = self._process
        if process.stdin is not None:  # where there is a guard, it kills whatever the agent has started as well
            process.stdin.close()
        try:
            process.wait(_LEAVING)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def read_report(path: Path) -> AgentExit | str:
    """Read what an agent's process says of how it ended. The agent may have written it: nonsense is left out.

    Returns:
        How the agent left its cell, or why it could not be made; empty where the file says neither.
    """
    with contextlib.suppress(OSError, ValueError, RecursionError), open_to_read(path) as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            return ""
        said = json.loads(file.read(_LONGEST_REPORT))
        if isinstance(said, dict) and isinstance(error := said.get("error"), str):
            if said.get("parting") == REFUSED:
                return showable(error) or "the agent could not be made"
            return AgentExit(Parting(str(said.get("parting"))), showable(error))
    return ""


def _pass_on(lines: IO[str] | None, say: Callable[[str], None]) -> None:
    """Pass on lines as they come."""
    if lines is not None:
        with lines:
            for line in lines:
                say(line.rstrip("\n"))


NODE = "/agent"

_NAP = 0.02  # [s]

_PATIENCE = 60.0
"""So long [s] of wall time an agent may go on when its run is over."""


@dataclass
class Host:
    """Hosts a cell for one agent.

    Args:
        cell: the cell.
        agent: the agent's name, as `find_agent` takes it.
        lockstep: whether time passes only while the agent waits; then the result is that of a run in one process.
        level: what the agent logs from this level on is passed on.
        say: takes each line that the agent prints; called from another thread.
        ros: has the cell known in ROS 1, where the agent comes to it that way; prepared, and closed by who made it.
        server: serves the cell; it is left open for those who look on. None: one that is there for the run alone.
        tempo: how time is to pass; None: as the run's options say.
    """

    cell: Cell
    agent: str
    lockstep: bool = False
    level: int = logging.WARNING
    say: Callable[[str], None] = print
    ros: Ros1 | None = None
    server: Server | None = None
    tempo: RateControl | None = None

    def __post_init__(self) -> None:
        self._serving: Serving | None = None
        self._is_interrupted = False
        self._was_there = False

    @property
    def is_interrupted(self) -> bool:
        """Whether there is a wish to end."""
        return self._is_interrupted

    def interrupt(self) -> None:
        """End the run before the next tick; to be called from anywhere, a signal's handler included."""
        self._is_interrupted = True
        if self._serving is not None:
            self._serving.stop()

    def run(self, options: RunOptions) -> RunResult:
        """Run the cell until it is over.

        Raises:
            AgentError: there is no such agent, or it could not be made.
            UnknownNameError: a topic to listen to that does not exist.
            CheckpointError: the checkpoint to begin from cannot be read, or is of another cell.
        """
        return execute_run(self.cell, partial(self._work, options), options)

    def _work(self, options: RunOptions, course: RunContext) -> tuple[Outcome, str]:
        server = self.server or Server(self.cell, port=0, lockstep=self.lockstep)
        child: AgentProcess | None = None

        def begin() -> None:
            nonlocal child
            if self.ros is not None:
                known = parameters(self.cell.trial, competition=self.cell.in_competition)
                self.ros.join(server.address, known, server.wait)
            if not self._is_interrupted:
                child = self._start(server)

        def look_after() -> None:
            if self.ros is not None:
                self.ros.poll()
            self._was_there = self._was_there or NODE in server.guests
            if child is None or not child.is_running:
                serving.stop()

        hooks = Hooks(on_ready=begin, on_poll=look_after)
        tempo = self.tempo or options.speed
        serving = self._serving = Serving(self.cell, server, tempo=tempo, hooks=hooks, patience=_PATIENCE)
        try:
            if self._is_interrupted:
                serving.stop()
            outcome, error = serving.work(course)
        finally:
            if self.server is None:
                server.close("the run is over")
            else:
                server.dismiss("the run is over", keep=names.is_viewer)
            if child is not None:
                child.end()
        if self._is_interrupted or child is None:
            return Outcome.INTERRUPTED, ""
        has_begun = self.cell.competition.state is not CompetitionState.INIT  # over ROS 1 its name is not known here
        worked = child.worked(was_there=self._was_there or has_begun)
        if outcome is Outcome.UNSTABLE:
            return outcome, error
        return self._outcome(worked, course)

    def _start(self, server: Server) -> AgentProcess:
        """Start the agent; over a socket no time passes before it is there."""
        way, more = ("socket", {}) if self.ros is None else ("ros1", self.ros.for_programs)
        child = AgentProcess(
            self.agent, server.address, node=NODE, way=way, level=self.level, say=self.say, environment=more
        )
        while self.ros is None and child.is_running and NODE not in server.guests and not self._is_interrupted:
            server.wait(_NAP)
        self._was_there = NODE in server.guests
        return child

    def _outcome(self, worked: AgentExit, course: RunContext) -> tuple[Outcome, str]:
        if worked.parting is Parting.CRASHED:
            return Outcome.CRASHED, worked.error
        if worked.parting is Parting.RETURNED:
            client = Client(course.transport)
            try:
                wait_for_kits(self.cell, client)
            except RunEndedError:
                pass
            finally:
                client.close()
        is_stopped = self.cell.simulation.now >= course.transport.stop.deadline
        return how_it_ended(self.cell, otherwise=Outcome.UNTIL if is_stopped else Outcome.GAVE_UP), ""
