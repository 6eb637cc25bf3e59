"""A lamp that shows whether the competition is on, and tells so on a topic."""

from collections.abc import Mapping
from typing import Any

from cellwright.cell.cell import Cell
from cellwright.cell.kitting.effects import CompetitionState, Effect, StateChanged
from cellwright.engine.device import Device, State
from cellwright.middleware.messages.standard import String


class SignalLamp(Device):
    """Shows the colour `running` while the competition is on, else `idle`; says it on `topic` when it changes."""

    def __init__(self, name: str, settings: Mapping[str, Any], cell: Cell) -> None:
        super().__init__(name)
        self._running = str(settings.get("running", "green"))
        self._idle = str(settings.get("idle", "yellow"))
        self.colour = self._idle
        self._publisher = cell.bus.advertise(str(settings["topic"]), "std_msgs/String", latch=True, rate="on event")
        cell.competition.on_effect.append(self._hear)
        self.stepping = False  # nothing to do in each tick

    def reset(self) -> None:
        """A new run."""
        self._show(self._idle)

    def get_state(self) -> State:
        """State for checkpoints."""
        return {"colour": self.colour}

    def set_state(self, state: State) -> None:
        """Go on from a checkpoint."""
        self._show(state["colour"])

    def _hear(self, effect: Effect) -> None:
        if isinstance(effect, StateChanged):
            self._show(self._running if effect.state is CompetitionState.GO else self._idle)

    def _show(self, colour: str) -> None:
        self.colour = colour
        self._publisher.publish(String(colour))
