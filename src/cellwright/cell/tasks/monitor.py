"""Monitor of a cell's task: whether it has succeeded, and its reward."""

from collections.abc import Callable
from fractions import Fraction

from cellwright.cell.tasks.conditions import holds, potential
from cellwright.cell.tasks.view import TaskView
from cellwright.config.trial.task import Task
from cellwright.engine.clock import PeriodicCallback, nanoseconds
from cellwright.engine.device import Device, State

PERIOD = Fraction(1, 50)
"""Time between two looks of a run [s]."""


class TaskMonitor(Device):
    """Device that judges the task of a cell when it is asked. The run does not depend on it.

    With `hold_for`, the conditions must hold at each instant at which it is asked, from the first one on. Runs ask
    every 20 ms, environments once a control period.

    Args:
        task: the task.
        view: the cell.

    Attributes:
        task: the task.
        view: view of the cell for its conditions.
        succeeded_at: time of the first success that was seen [ns]; None before.

    Example:
        >>> from cellwright import Cell, load_trial
        >>> cell = Cell(load_trial("pick_from_bin"))
        >>> cell.task.success, round(cell.task.reward(), 2)
        (False, 0.0)
    """

    def __init__(self, task: Task, view: TaskView) -> None:
        super().__init__("task")
        self.task = task
        self.view = view
        self._hold = nanoseconds(task.hold_for)
        self.succeeded_at: int | None = None
        self._since: int | None = None
        self._asked = -1

    def reset(self) -> None:
        """Begin a run: nothing has succeeded."""
        self.set_record({})

    @property
    def success(self) -> bool:
        """True if the task is done as of this tick."""
        now = self.simulation.now
        if now != self._asked:
            self._asked = now
            if not all(holds(each, self.view) for each in self.task.success):
                self._since = None
            elif self._since is None:
                self._since = now
        done = self._since is not None and now - self._since >= self._hold
        if done and self.succeeded_at is None:
            self.succeeded_at = now
        return done

    def potential(self) -> float:
        """Return how near the task is to its success, from 0 to 1: the mean of its conditions' potentials."""
        conditions = self.task.success
        return sum(potential(each, self.view) for each in conditions) / len(conditions)

    def reward(self) -> float:
        """Return the reward as of this tick: 1 at success; else 0, or the potential if the reward is shaped."""
        if self.success:
            return 1.0
        return self.potential() if self.task.reward == "shaped" else 0.0

    def watch(self, on_success: Callable[[], None] = lambda: None) -> PeriodicCallback:
        """Look each `PERIOD` from now on; `on_success` is called at each look that sees a success.

        Returns:
            The watch, to cancel it.
        """

        def look(_number: int) -> None:
            if self.success:
                on_success()

        return self.simulation.watch("task", PERIOD, look)

    def get_record(self) -> State:
        """Return since when the conditions hold, and the first success [ns]; empty before."""
        if self._since is None and self.succeeded_at is None:
            return {}
        return {"since": self._since, "succeeded_at": self.succeeded_at, "asked": self._asked}

    def set_record(self, record: State) -> None:
        """Restore what `get_record` returned."""
        self._since, self.succeeded_at = record.get("since"), record.get("succeeded_at")
        self._asked = record.get("asked", -1)
