"""Start of a task in the cell: the competition starts without a client, and the cup may hold a part."""

from __future__ import annotations

from collections.abc import Iterable

from cellwright.cell.competition import Competition
from cellwright.cell.devices.grippers import Gripper
from cellwright.cell.devices.vacuum_gripper import VacuumGripper
from cellwright.cell.kitting.effects import CompetitionState
from cellwright.config.trial.task import Task
from cellwright.engine.device import Device


class TaskStarter(Device):
    """Device that starts a task in the first step of a run.

    Args:
        task: the task.
        competition: the competition, started unless the task leaves it to a client.
        grippers: those of the cell; the only one may hold a part, if it is a cup.
    """

    def __init__(self, task: Task, competition: Competition, grippers: Iterable[Gripper]) -> None:
        super().__init__("task_start")
        self._task, self._competition = task, competition
        self._cups = [each for each in grippers if isinstance(each, VacuumGripper)]

    def reset(self) -> None:
        """Let the cup hold its part; the competition starts with the first step."""
        kind = self._task.start.holding
        if kind is not None:
            self._cups[0].begin_with(kind)
        if self._task.starts_competition:
            self.simulation.schedule(self, "begin", at=self.simulation.now + 1)

    def handle_begin(self) -> None:
        """Start the competition, unless a client has done so."""
        if self._competition.state is CompetitionState.INIT:
            self._competition.start()
