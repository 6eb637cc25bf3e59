"""The conveyor belt: a surface that moves under what lies on it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from cellwright.cell.devices.parts import Parts
from cellwright.cell.model.build import WorldPart
from cellwright.engine.device import Device, State
from cellwright.engine.simulation import Simulation

FULL_SPEED = 0.2
"""Belt speed [m/s] at 100 % power, towards world -y (ARIAC 2017, kMaxBeltLinVel)."""

BELT_GEOM = "conveyor_belt"

_SLOW = 2.0
"""Below this many times the engine's sleep tolerance [m/s] parts would fall asleep on the moving belt."""


class Conveyor(Device):
    """The belt. `power` is in percent of full speed, 0 to 100."""

    def __init__(self, parts: Parts) -> None:
        super().__init__("conveyor")
        self.parts = parts
        self.power = 0.0
        self.on_power: list[Callable[[Conveyor], None]] = []
        """Those who are told when the power has been set."""
        self._geom = -1

    def attach(self, simulation: Simulation) -> None:
        """Look up the belt."""
        super().attach(simulation)
        self._geom = simulation.model.geom(BELT_GEOM).id
        # Without the flag the engine takes no notice of surface velocities that were all zero when it compiled.
        simulation.model.flg_surfacevel = 1

    def reset(self) -> None:
        """Stand still."""
        self.power = 0.0
        self.set_stepping(False)

    @property
    def speed(self) -> float:
        """Speed of the surface [m/s] towards world -y."""
        return FULL_SPEED * self.power / 100.0

    def set_power(self, power: float) -> bool:
        """Run at `power` percent; anything outside 0..100 is ignored, as in the original. Whether it was taken."""
        if not (math.isfinite(power) and 0.0 <= power <= 100.0):
            return False
        if power != self.power:
            self.power = power
            self._drive()
        for listener in self.on_power:
            listener(self)
        return True

    def before_step(self) -> None:
        """Keep awake what rides so slowly that the engine takes it for being at rest."""
        for part in self._on_belt():
            self.simulation.keep_awake(part.body)

    def get_state(self) -> dict[str, Any]:
        """The power."""
        return {"power": self.power}

    def set_state(self, state: State) -> None:
        """Remember what `get_state` returned; the surface's velocity is restored with the model."""
        self.power = state["power"]

    def _drive(self) -> None:
        simulation = self.simulation
        model = simulation.model
        # The surface velocity is given in the geom's own frame, and the geom may be turned.
        simulation.refresh()
        world_R_geom = simulation.data.geom_xmat[self._geom].reshape(3, 3)
        model.geom_surfacevel[self._geom, :3] = world_R_geom.T @ (0.0, -self.speed, 0.0)
        for part in self._on_belt():
            simulation.wake(part.body)  # a changed surface velocity wakes nobody
        self.set_stepping(0.0 < self.speed < _SLOW * model.opt.sleep_tolerance)

    def _on_belt(self) -> list[WorldPart]:
        simulation = self.simulation
        simulation.refresh()
        centre = simulation.data.geom_xpos[self._geom]
        size = simulation.model.geom_size[self._geom]
        return self.parts.inside(
            (centre[0] - size.max(), centre[1] - size.max(), centre[2]),
            (centre[0] + size.max(), centre[1] + size.max(), centre[2] + size.min() + 1.0),
        )
