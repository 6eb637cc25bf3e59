"""A person for tests: asks the operator agent over the bus, each time once the condition before has come true."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from typing import Any

from cellwright.cell.cell import Cell
from cellwright.clients.agents.operator.requests import COMMAND
from cellwright.middleware.messages.osrf_gear import VacuumGripperControlRequest
from cellwright.middleware.messages.standard import String

Plan = Callable[["Person"], Iterator[Callable[[], bool]]]
"""Asks, and yields conditions to wait for."""


class Person:
    """Person at a cell, who looks twenty times a simulated second.

    Args:
        cell: the cell.
        plan: the requests.
    """

    def __init__(self, cell: Cell, plan: Plan) -> None:
        self.cell = cell
        self.is_done = False
        self._plan = plan(self)
        self._until: Callable[[], bool] = lambda: bool(self.state)
        self._watch = cell.simulation.watch("person", Fraction(1, 20), self._look)

    @property
    def state(self) -> Mapping[str, Any]:
        """Newest report of the agent; empty before."""
        return self.cell.intention.operator.state or {}

    def arm(self, name: str = "arm") -> Mapping[str, Any]:
        """Report about an arm."""
        found: Mapping[str, Any] = self.state["arms"][name]
        return found

    def is_idle(self, name: str = "arm") -> bool:
        """Return whether an arm rests."""
        return bool(self.arm(name)["mode"] == "idle")

    def publish(self, topic: str, message: Any) -> None:
        """Publish a message."""
        self.cell.bus.publish(topic, message, node="/person")

    def say(self, command: str) -> None:
        """Give a command."""
        self.publish(COMMAND, String(command))

    def suck(self, enable: bool, space: str = "/ariac") -> None:
        """Switch the suction."""
        self.cell.bus.call(f"{space}/gripper/control", VacuumGripperControlRequest(enable=enable), node="/person")

    def after(self, seconds: float) -> Callable[[], bool]:
        """Return the condition that a time has passed."""
        end = self.cell.simulation.time + seconds
        return lambda: self.cell.simulation.time >= end

    def _look(self, _time: int) -> None:
        while not self.is_done and self._until():
            try:
                self._until = next(self._plan)
            except StopIteration:
                self.is_done = True
                self._watch.cancel()
