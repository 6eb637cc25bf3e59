"""The wall at the end of the belt: what touches it leaves the cell."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mujoco

from cellwright.cell.devices.parts import Parts
from cellwright.cell.model.build import WorldPart
from cellwright.cell.model.furniture import DELETION_WALL_GEOM
from cellwright.engine.clock import nanoseconds
from cellwright.engine.device import Device
from cellwright.engine.simulation import Simulation

PERIOD = Fraction(1, 5)
"""Time between two looks at the wall [s] (ARIAC 2017: the plugin's 5 Hz)."""

_REACH = 0.4
"""No part is larger [m]: an origin further from the wall than this cannot touch it."""


class DeletionWall(Device):
    """Removes parts that touch the wall's volume."""

    def __init__(self, parts: Parts) -> None:
        super().__init__("deletion_wall")
        self.parts = parts
        self._geom = -1

    def attach(self, simulation: Simulation) -> None:
        """Look up the wall."""
        super().attach(simulation)
        self._geom = simulation.model.geom(DELETION_WALL_GEOM).id

    def reset(self) -> None:
        """Look five times a second from now on."""
        self._schedule(1)

    def handle(self, kind: str, arguments: tuple[Any, ...]) -> None:
        """Look for parts that touch the wall."""
        if kind != "look":
            super().handle(kind, arguments)
        self._schedule(arguments[0] + 1)
        centre = self.simulation.model.geom_pos[self._geom]
        half = self.simulation.model.geom_size[self._geom] + _REACH
        for part in self.parts.inside(centre - half, centre + half):
            self.simulation.refresh()
            if self._touches(part):
                self.parts.put_away(part, "deletion wall")

    def _schedule(self, look: int) -> None:
        self.simulation.schedule(self, "look", look, at=nanoseconds(look * PERIOD))

    def _touches(self, part: WorldPart) -> bool:
        model, data = self.simulation.model, self.simulation.data
        return any(mujoco.mj_geomDistance(model, data, geom, self._geom, 1e-3, None) <= 0.0 for geom in part.geoms)
