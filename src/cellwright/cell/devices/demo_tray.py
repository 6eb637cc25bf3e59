"""A tray filled for demonstration: the parts of the first order dropped onto AGV 1's tray, one in each step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from cellwright.cell.devices.kit_tray import KitTray
from cellwright.cell.devices.parts import Parts
from cellwright.cell.model.build import WorldPart
from cellwright.config.trial.trial import KitObject
from cellwright.engine.device import Device
from cellwright.util.pose import Pose

HEIGHT = 0.1
"""Height over the tray link from which the parts are dropped [m] (ARIAC 2017)."""


class DemoTray(Device):
    """Drops `parts[i]` at the ordered place and turn of `objects[i]`, beginning when it is told to."""

    def __init__(self, tray: KitTray, parts: Parts, pool: Sequence[WorldPart], objects: Sequence[KitObject]) -> None:
        super().__init__("demo_tray")
        self.tray = tray
        self.parts = parts
        self._pool = tuple(pool)
        self._objects = tuple(objects)

    def fill(self) -> None:
        """Begin with the next step."""
        self.simulation.schedule(self, "drop", 0, at=self.simulation.now + 1)

    def handle(self, kind: str, arguments: tuple[Any, ...]) -> None:
        """Drop one part."""
        if kind != "drop":
            super().handle(kind, arguments)
        number = arguments[0]
        if number < len(self._objects):
            ordered = self._objects[number].pose
            x, y, _ = ordered.position
            tray_T_part = Pose((x, y, HEIGHT), ordered.quaternion)
            self.parts.place(self._pool[number], self.tray.world_T_tray @ tray_T_part)
            self.simulation.schedule(self, "drop", number + 1, at=self.simulation.now + 1)
