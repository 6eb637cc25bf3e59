"""A run under way, and how it ends."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import TypeAlias

from cellwright.cell.cell import Cell
from cellwright.clients.client.client import Client
from cellwright.clients.client.transports.in_process import InProcess
from cellwright.running.run.result import Outcome, RunResult

DRIVE = 30.0
"""Simulation time [s] for which a kit that is on its way is waited for after the agent has returned."""


class Course:
    """A run under way.

    Args:
        cell: what runs.
        transport: what lets its time pass, up to the deadline that it has.
        heard: how many messages were counted so far, by topic.
    """

    def __init__(self, cell: Cell, transport: InProcess, heard: Mapping[str, int]) -> None:
        self.cell = cell
        self.transport = transport
        self.on_reset: list[Callable[[int], None]] = []
        """Those who are told, with the time [ns] at which it was, that the run has begun anew under way."""
        self._heard = heard
        self._end = transport.deadline, transport.reason
        self._tick = cell.simulation.clock.tick
        self._wall = time.perf_counter()

    def begin_anew(self) -> None:
        """Begin the run anew, at time 0, for those who work the cell from elsewhere."""
        stood, self._tick = self.cell.simulation.now, 0
        self.cell.reset()
        self.transport.deadline, self.transport.reason = self._end
        for listener in self.on_reset:
            listener(stood)

    def result(self, outcome: Outcome, error: str = "") -> RunResult:
        """What has come of it by now."""
        cell, clock = self.cell, self.cell.simulation.clock
        return RunResult(
            outcome=outcome,
            competition_state=cell.competition.state,
            score=cell.competition.score(),
            evidence=cell.competition.evidence(),
            state_hash=cell.state_hash(),
            simulated=cell.simulation.time - self._tick * float(clock.timestep),
            wall=time.perf_counter() - self._wall,
            steps=clock.tick - self._tick,
            error=error,
            heard=dict(self._heard),
        )


Work: TypeAlias = Callable[[Course], tuple[Outcome, str]]
"""Lets time pass until a run is over; says how it ended, and what went wrong."""


def how_it_ended(cell: Cell, *, otherwise: Outcome) -> Outcome:
    """How a run ended that came to its end: by the competition, or otherwise."""
    if cell.competition.state != "done":
        return otherwise
    return Outcome.TIME_LIMIT if cell.competition.is_timed_out else Outcome.DONE


def wait_for_kits(cell: Cell, client: Client) -> None:
    """The agent has returned; kits that it sent off still arrive, and the competition may still end."""
    competition, agvs = cell.competition, tuple(cell.agvs.values())

    def nothing_to_come() -> bool:
        return competition.state == "done" or all(agv.state != "preparing_to_deliver" for agv in agvs)

    client.wait_until(nothing_to_come, DRIVE)
    client.wait_until(lambda: competition.state == "done", 0.1)
