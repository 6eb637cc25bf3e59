"""The conveyor's population: parts from the pool appear on the belt as the trial's list says."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, TypeAlias

from cellwright.cell.devices.conveyor import Conveyor
from cellwright.cell.devices.parts import Parts
from cellwright.cell.devices.population_schedule import PopulationSchedule
from cellwright.cell.model.frames import SPAWN_FRAME
from cellwright.config.trial.trial import BeltPart
from cellwright.engine.device import Device, State
from cellwright.engine.events import NEVER

Action: TypeAlias = Literal["pause", "resume", "restart"]


class Population(Device):
    """Puts parts on the belt. The list runs at the pace of the belt, and begins `delay` [s] late."""

    def __init__(
        self, belt_parts: Sequence[BeltPart], cycles: int, conveyor: Conveyor, parts: Parts, delay: float = 0.0
    ) -> None:
        super().__init__("population")
        self.parts = parts
        self._schedule = PopulationSchedule(belt_parts, cycles, delay)
        conveyor.on_power.append(self._take_power)

    @property
    def enabled(self) -> bool:
        """Whether the list is being gone through."""
        return self._schedule.running

    def control(self, action: Action) -> None:
        """Pause, resume where it was paused, or restart the list from its beginning."""
        now = self.simulation.now
        {"pause": self._schedule.pause, "resume": self._schedule.resume, "restart": self._schedule.restart}[action](now)
        self._plan()

    def reset(self) -> None:
        """Stand at the beginning of the list."""
        self._schedule.reset()

    def handle(self, kind: str, arguments: tuple[Any, ...]) -> None:
        """Let the part that is due appear, if the pool still has one."""
        if kind != "appear":
            super().handle(kind, arguments)
        appearance = self._schedule.pop(self.simulation.now)
        if appearance is not None and appearance.in_pool:
            self.parts.place(self.parts.part(appearance.name), SPAWN_FRAME @ appearance.pose)
        self._plan()

    def get_state(self) -> dict[str, Any]:
        """How far the list has been gone through."""
        return self._schedule.get_state()

    def set_state(self, state: State) -> None:
        """Remember what `get_state` returned."""
        self._schedule.set_state(state)

    def _take_power(self, conveyor: Conveyor) -> None:
        self._schedule.set_power(conveyor.power, self.simulation.now)
        self._plan()

    def _plan(self) -> None:
        self.simulation.cancel(self, "appear")
        due = self._schedule.next_due()
        if due < NEVER:
            self.simulation.schedule(self, "appear", at=max(due, self.simulation.now))
