"""What programs can be let in to: a cell, or a robot's controller node."""

from __future__ import annotations

from collections.abc import Collection
from typing import Protocol

from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus.bus import Bus


class Served(Protocol):
    """Whatever has topics and services, and time that passes."""

    @property
    def name(self) -> str:
        """What it is called where one is told of it: the trial, the robot."""
        ...

    @property
    def bus(self) -> Bus:
        """Its topics and services."""
        ...

    @property
    def simulation(self) -> Simulation:
        """Its time."""
        ...

    @property
    def in_competition(self) -> bool:
        """Whether what a competition refuses is refused."""
        ...

    def out_of_sight(self) -> Collection[int]:
        """The engine's ids of bodies that are not there to be seen at the moment, such as parts out of play."""
        ...
