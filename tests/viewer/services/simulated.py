"""The lesson's cell with the services of `simulation_interfaces`, called as a server does."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from cellwright import load_trial
from cellwright.cell.cell import Cell
from cellwright.config.trial.trial import Trial
from cellwright.engine.rate_control import RateControl
from cellwright.middleware.bus import PendingResponse
from cellwright.viewer.services.control import Control, Reset
from cellwright.viewer.services.entity_services import EntityServices
from cellwright.viewer.services.simulation import SimulationServices
from cellwright.viewer.services.simulation_requests import PREFIX

STEP = 2_000_000
"""Length of a step [ns]."""

GEAR = "bin8|gear_part_1"
IN_BIN7 = {"position": {"x": -0.3, "y": 0.23, "z": 0.9}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}}


class Stop:
    """Stop condition that only notes the request."""

    reason = ""

    def request(self, reason: str) -> None:
        self.reason = reason


class Services:
    """The lesson's cell with its services, called as a server does."""

    def __init__(
        self, *, competition: bool = False, lockstep: bool = False, trial: str = "lesson", can_load: bool = False
    ) -> None:
        self.loaded: list[Trial] = []
        self.cell = Cell(load_trial(trial), competition=competition)
        self.rate = RateControl(None)
        self.stop = Stop()
        self.handlers: dict[str, Callable[[dict[str, Any]], Any]] = {}
        self.acting: set[str] = set()
        reset = Reset(self.cell.reset, act_on_state=partial(self.cell.reset, keeps_clock=True))
        control = Control(self.rate, reset=reset, lockstep=lockstep)
        entities = EntityServices(self.cell)
        self.entities = entities.entities
        SimulationServices(
            self.cell, control, stop=self.stop, entities=entities, load=self.loaded.append if can_load else None
        ).offer(self)

    def offer(self, service: str, handler: Callable[..., Any], *, acts: bool = False) -> None:
        name = service.removeprefix(PREFIX)
        self.handlers[name] = handler
        if acts:
            self.acting.add(name)

    def __call__(self, service: str, /, **request: Any) -> Any:
        return self.handlers[service](request)

    def code(self, service: str, /, **request: Any) -> tuple[int, str]:
        result = self(service, **request)["result"]
        return result["result"], result["error_message"]

    @property
    def features(self) -> set[int]:
        """Features that are listed now."""
        return set(self("GetSimulatorFeatures")["features"]["features"])

    @property
    def state(self) -> int:
        """State of the simulation."""
        found: int = self("GetSimulationState")["state"]["state"]
        return found

    def step(self, steps: int) -> Any:
        """Step the paused cell; return the result."""
        pending = self("StepSimulation", steps=steps)
        assert isinstance(pending, PendingResponse)
        while self.rate.take():
            self.cell.step()
        return pending.response["result"]

    def position(self, name: str) -> list[float]:
        """Return the position of an entity."""
        return list(self("GetEntityState", entity=name)["state"]["pose"]["position"].values())
