"""A run whose agent works in a process of its own, over a socket; all else is as in one process."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from cellwright.cell.cell import Cell
from cellwright.cell.interface.parameters import parameters
from cellwright.cell.kitting.effects import CompetitionState
from cellwright.clients.client.client import Client
from cellwright.engine.tempo import Tempo
from cellwright.middleware.ros1.host import Ros1
from cellwright.middleware.server import Server
from cellwright.running.remote.child import AgentProcess
from cellwright.running.remote.working import Parting, Worked
from cellwright.running.run import Course, Outcome, RunOptions, RunResult, conduct, how_it_ended, wait_for_kits
from cellwright.running.serving import Hooks, Serving
from cellwright.util.errors import RunEndedError
from cellwright.viewer.services import names

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
    tempo: Tempo | None = None

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
        return conduct(self.cell, partial(self._work, options), options)

    def _work(self, options: RunOptions, course: Course) -> tuple[Outcome, str]:
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
                server.dismiss("the run is over", keep=names.is_onlooker)
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

    def _outcome(self, worked: Worked, course: Course) -> tuple[Outcome, str]:
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
        is_stopped = self.cell.simulation.now >= course.transport.deadline
        return how_it_ended(self.cell, otherwise=Outcome.UNTIL if is_stopped else Outcome.GAVE_UP), ""
