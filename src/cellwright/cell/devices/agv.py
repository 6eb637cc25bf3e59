"""An automated guided vehicle: it takes the tray away with the kit on it, and comes back empty."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, TypeAlias

from cellwright.cell.devices.agv_path import AgvPath
from cellwright.cell.devices.kit_tray import KitTray
from cellwright.engine.device import Device, State
from cellwright.engine.simulation import Simulation

AgvState: TypeAlias = Literal["ready_to_deliver", "preparing_to_deliver", "delivering", "delivered", "returning"]

PREPARATION = 0.75
"""Time between the call and the departure [s] (ARIAC 2017)."""


class Agv(Device):
    """AGV number 1 or 2.

    A call sets it preparing; after 0.75 s the parts are locked to the tray, the kit is submitted (`on_submit` is called
    with the kit type) and it drives off; at the end of the way the kit leaves the cell, and it comes back.
    """

    def __init__(self, number: int, tray: KitTray) -> None:
        super().__init__(f"agv{number}")
        self.number = number
        self.tray = tray
        self.state: AgvState = "ready_to_deliver"
        self.kit_type = ""
        self.on_submit: list[Callable[[Agv, str], None]] = []
        self._paths = {"delivering": AgvPath.deliver(number), "returning": AgvPath.return_(number)}
        self._station = self._paths["delivering"].position_at(0)
        self._departed = 0
        self._ctrl = (0, 0)

    def attach(self, simulation: Simulation) -> None:
        """Look up the servos of its two slides."""
        super().attach(simulation)
        model = simulation.model
        first, second = (model.actuator_ctrladr[model.actuator(f"{self.name}_{axis}").id] for axis in "xy")
        self._ctrl = (int(first), int(second))

    def reset(self) -> None:
        """Stand at the station, ready."""
        self.state = "ready_to_deliver"
        self.kit_type = ""
        self._departed = 0
        self._drive(*self._station, 0.0, 0.0)
        self.set_stepping(False)

    def send(self, kit_type: str) -> bool:
        """Ask it to take its tray away as a kit of this type; False unless it is ready."""
        if self.state != "ready_to_deliver":
            return False
        self.state = "preparing_to_deliver"
        self.kit_type = kit_type
        self.simulation.schedule(self, "depart", delay=PREPARATION)
        return True

    def handle(self, kind: str, arguments: tuple[Any, ...]) -> None:
        """Carry on to the next state."""
        if kind == "depart":
            self.tray.lock()
            self._set_off("delivering")
            for listener in self.on_submit:
                listener(self, self.kit_type)
        elif kind == "arrive" and self.state == "delivering":
            self.state = "delivered"
            self.tray.clear()
            self.simulation.schedule(self, "turn", at=self.simulation.now + 1)
        elif kind == "turn":
            self._set_off("returning")
        elif kind == "arrive":
            self.state = "ready_to_deliver"
            self.set_stepping(False)
            self._drive(*self._station, 0.0, 0.0)
        else:
            super().handle(kind, arguments)

    def before_step(self) -> None:
        """Drive along the way."""
        path = self._paths.get(self.state)
        if path is not None:
            since = self.simulation.now - self._departed
            clock = self.simulation.clock
            x, y = path.position_at(since)
            self._drive(x, y, *path.velocity_at(clock.time_of(clock.tick + 1) - self._departed))

    def get_state(self) -> dict[str, Any]:
        """State, kit type and time of departure."""
        return {"state": self.state, "kit_type": self.kit_type, "departed": self._departed}

    def set_state(self, state: State) -> None:
        """Remember what `get_state` returned."""
        self.state = state["state"]
        self.kit_type = state["kit_type"]
        self._departed = state["departed"]

    def _set_off(self, state: Literal["delivering", "returning"]) -> None:
        self.state = state
        self._departed = self.simulation.now
        self.simulation.schedule(self, "arrive", at=self._departed + self._paths[state].duration)
        self.set_stepping(True)
        self.simulation.wake(self.simulation.model.body(self.name).id)

    def _drive(self, x: float, y: float, vx: float, vy: float) -> None:
        """Setpoints of the two slides: position in the world frame [m] and velocity [m/s]."""
        ctrl = self.simulation.data.ctrl
        ix, iy = self._ctrl
        ctrl[ix], ctrl[ix + 1] = x - self._station[0], vx
        ctrl[iy], ctrl[iy + 1] = y - self._station[1], vy
