"""Commands of a recorded run, played to a new cell: what they earn does not depend on the program that sent them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cellwright.cell.cell import Cell
from cellwright.engine.clock import nanoseconds
from cellwright.recording.format.reader import RecordingFile
from cellwright.running.evaluation.execution.channel import Report
from cellwright.running.evaluation.results.result import POINT_TOLERANCE
from cellwright.running.run import Outcome, Program, Session, final_outcome
from cellwright.util.errors import RecordingError, SimulationError

_OF_THE_CELL = (Outcome.DONE, Outcome.TASK_FAILED, Outcome.TIME_LIMIT, Outcome.UNSTABLE)
"""Outcomes that the cell alone decides."""


class ReplayedCommands(Program):
    """Player of the commands in a recording. Nothing else of it counts: the cell is the judge's own.

    Args:
        path: the recording.
        end: simulation time [s] at which the run ended.
    """

    def __init__(self, path: Path, end: float) -> None:
        self._path = path
        self._end = end

    def work(self, session: Session) -> tuple[Outcome, str]:
        """Play the commands, each at its tick, up to the end of the run.

        Raises:
            RecordingError: the recording cannot be read, or holds what no program can send.
        """
        cell = session.node
        assert isinstance(cell, Cell)
        simulation = cell.simulation
        end = nanoseconds(self._end)
        try:
            with RecordingFile(self._path) as recording:
                for command in recording.commands():
                    time = simulation.clock.time_of(command.tick)
                    if time > end:
                        raise RecordingError(f"{self._path}: has a command after the end of the run")
                    if simulation.now < time:
                        simulation.step_until(time)
                    command.carry_out(cell.bus)
            if simulation.now < end:
                simulation.step_until(end)
        except SimulationError as error:
            return Outcome.UNSTABLE, f"{error}\n"
        return final_outcome(cell, otherwise=Outcome.UNTIL), ""


def first_difference(reported: Report, played: Report) -> str:
    """Return the first difference of a run from its commands alone, in words; empty if there is none."""
    if abs(reported.points - played.points) > POINT_TOLERANCE:
        return f"its commands alone earn {played.points:g} points, but {reported.points:g} were reported"
    if reported.success != played.success:
        words = "succeed" if played.success else "do not succeed"
        return f"its commands alone {words} in the task, other than was reported"
    decided = {outcome.name.lower() for outcome in _OF_THE_CELL}
    # How a program ends, such as by a crash, its commands do not show. What the cell decides, they do.
    if reported.outcome != played.outcome and (reported.outcome in decided or played.outcome == "unstable"):
        return f"its commands alone end as {played.outcome}, but {reported.outcome} was reported"
    if _kits(reported.score) != _kits(played.score):
        return "its commands alone give other kits than were reported"
    if reported.state_hash != played.state_hash:
        return "its commands alone lead to another state of the cell"
    return ""


def _kits(score: Mapping[str, Any]) -> Any:
    return score.get("orders")
