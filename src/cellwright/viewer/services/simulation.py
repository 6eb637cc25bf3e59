"""Services of the standard `simulation_interfaces`, with JSON in and out: `simulation/GetEntities` and the like.

Requests and responses have the fields of the standard's services, in version 1 or 2. Every response but that of
`GetSimulatorFeatures` has a `result` with a code and an error message. The bridge to ROS 2 offers the same services by
their types; Python needs no ROS for them.

A competition has only those that neither tell where parts are nor change anything; the others answer
FEATURE_UNSUPPORTED.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Protocol

from cellwright.config.trial.catalogue import bundled, find_trial, scenario
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.engine.simulation import Simulation
from cellwright.middleware.bus import PendingResponse
from cellwright.util.errors import CellwrightError, UnknownNameError
from cellwright.viewer.services.control import MAX_TICKS, Control
from cellwright.viewer.services.entity_services import EntityServices
from cellwright.viewer.services.simulation_requests import (
    ALL,
    ALREADY_THERE,
    FAILED,
    INCORRECT_STATE,
    NO_WORLD,
    PREFIX,
    SPAWNED,
    STATE,
    TIME,
    UNKNOWN_STATE,
    UNSUPPORTED,
    WORLD_PARSE_ERROR,
    Answer,
    LoadWorld,
    Method,
    OfWorlds,
    RequestError,
    Scope,
    SetSimulationState,
    Steps,
    answer,
    answered,
)

STOPPED, PLAYING, PAUSED, QUITTING, _, LOADING = range(6)
"""Values of `simulation_interfaces/SimulationState`."""

PUBLIC = frozenset({2, 3, 24, 42, 44, 45})
"""Features in a competition: named poses and their bounds, state, tags, present and available worlds."""

OF_ENTITIES = frozenset({*range(9), *range(10, 15), 23})
"""Features of a cell: all of entities but models as text, and the reset of what was spawned."""

OF_TIME = frozenset({20, 21, 22, 24, 25, 26, 31, 32, 33})
"""Features of every simulation."""

OF_WORLDS = frozenset({42, 44, 45})
"""Features of trials as worlds: tags, present world, available worlds."""

MAX_PENDING_STEPS = 16
"""Largest number of calls of `StepSimulation` that wait for their last step."""

OF_LOADING = frozenset({40, 41})
"""Features of a session that can load another trial: by name, and from its text."""

NO_LOADING = (
    "worlds are loaded by `cellwright serve -d` only, without --ros1, --lockstep, --json, a page or output files"
)
"""Reason why a session cannot load another trial."""


class Stoppable(Protocol):
    """Session that can be stopped."""

    def request(self, reason: str) -> None:
        """Request the end, with its reason."""


class Offers(Protocol):
    """Server that takes services."""

    def offer(self, service: str, handler: Callable[..., Any], *, acts: bool = False) -> None:
        """Offer a service."""


class SimulationServices:
    """Services of time and state, of the present world, and of the entities of a cell.

    Args:
        simulation: what is simulated.
        control: its time control.
        world: name of the trial or robot.
        stop: stops the session.
        entities: services of the cell's entities; None for a robot.
        load: ends the session soon, and starts another one with a trial; None if that is not possible.
        hides: true in a competition.
        has_clock: False if messages carry wall time, which cannot be reset.
    """

    def __init__(
        self,
        simulation: Simulation,
        control: Control,
        *,
        world: str,
        stop: Stoppable,
        entities: EntityServices | None = None,
        load: Callable[[Trial], None] | None = None,
        hides: bool = False,
        has_clock: bool = True,
    ) -> None:
        self._simulation = simulation
        self._control = control
        self._world = world
        self._stop = stop
        self._entities = entities
        self._load = load
        self._is_loading = False
        self._hides = hides
        self._has_clock = has_clock
        self._pending: list[PendingResponse] = []
        simulation.on_reset.append(self._interrupt)
        simulation.on_rewind.append(lambda _time: self._interrupt())

    def offer(self, server: Offers) -> None:
        """Offer all services; those that a competition refuses answer FEATURE_UNSUPPORTED there."""
        public: dict[str, Method] = {
            "GetSimulatorFeatures": (self.features, None),
            "GetSimulationState": (self.state, None),
        }
        secret: dict[str, Method] = {
            "SetSimulationState": (self.set_state, SetSimulationState),
            "ResetSimulation": (self.reset, Scope),
            "StepSimulation": (self.step, Steps),
        }
        if self._entities is not None:
            public |= self._entities.public | {
                "GetCurrentWorld": (self.current_world, None),
                "GetAvailableWorlds": (self.available_worlds, OfWorlds),
            }
            secret |= {**self._entities.secret, "LoadWorld": (self.load_world, LoadWorld)}
        for name, (method, request_class) in public.items():
            server.offer(f"{PREFIX}{name}", partial(answered, method, request_class))
        for name, (method, request_class) in secret.items():
            if self._hides:
                server.offer(f"{PREFIX}{name}", lambda _request: answer(UNSUPPORTED, "not allowed in a competition"))
            else:
                acts = self._entities is not None and name in EntityServices.ACTING
                server.offer(f"{PREFIX}{name}", partial(answered, method, request_class), acts=acts)

    def features(self) -> Answer:
        """Return the features that are available here."""
        found = OF_TIME if self._entities is None else OF_TIME | OF_ENTITIES | OF_WORLDS
        if self._load is not None:
            found |= OF_LOADING
        if "pause" in self._refused:  # as a real robot
            found -= {25, 26, 31, 32, 33}
        if "reset" in self._refused:
            found -= {20, 21}
        if "reset_state" in self._refused:
            found -= {22}
        if not self._has_clock:
            found -= {21}
        features = sorted(found & PUBLIC if self._hides else found)
        return {"features": {"features": features, "spawn_formats": [], "custom_info": "Cellwright"}}

    def state(self) -> Answer:
        """Return the state of the simulation."""
        return answer(state={"state": self._state})

    def set_state(self, request: SetSimulationState) -> Answer:
        """Pause, resume, stop (reset and pause) or quit."""
        wanted = request.state.state
        if self._is_loading:
            raise RequestError(INCORRECT_STATE, "a world is being loaded")
        if wanted not in (STOPPED, PLAYING, PAUSED, QUITTING):
            raise RequestError(UNKNOWN_STATE, f"state must be from 0 to 3 (got {wanted})")
        is_stepping = self._control.rate_control.is_paused and self._state == PLAYING
        if wanted == self._state and not is_stepping:  # steps that run are PLAYING, and may be resumed for good
            raise RequestError(ALREADY_THERE, "the simulation is in this state already")
        if wanted == QUITTING:
            self._stop.request("a client ended the simulation")
            return answer()
        if wanted == STOPPED:
            self._control.control({"action": "pause"})
            self._control.control({"action": "reset"})
        else:
            self._control.control({"action": "resume" if wanted == PLAYING else "pause"})
            if wanted == PAUSED:
                self._interrupt("paused")  # their steps do not come
        return answer()

    def reset(self, request: Scope) -> Answer:
        """Reset the run, its state while the clock goes on, or only what was spawned.

        The state includes what was spawned. Time is reset with the state only.
        """
        scope = request.scope or ALL
        if scope == SPAWNED and self._entities is not None:
            return self._entities.delete_spawned(Scope(SPAWNED))
        if not scope & STATE:
            raise RequestError(UNSUPPORTED, f"scope must have STATE, or be SPAWNED alone (got {scope})")
        if scope & TIME and scope != ALL and not self._has_clock:
            raise RequestError(UNSUPPORTED, "messages carry wall time, which is not reset; leave TIME out")
        self._control.control({"action": "reset" if scope & TIME else "reset_state"})
        return answer()

    def step(self, request: Steps) -> Answer | PendingResponse:
        """Step a paused simulation; the answer comes after the last step."""
        if not 1 <= request.steps <= MAX_TICKS:
            raise RequestError(FAILED, f"steps must be from 1 to {MAX_TICKS} (got {request.steps})")
        if self._control.state()["lockstep"]:
            raise RequestError(INCORRECT_STATE, "in lockstep time passes on request of /cellwright/step")
        if not self._control.rate_control.is_paused:
            raise RequestError(INCORRECT_STATE, "the simulation is not paused; pause it first")
        if len(self._pending) >= MAX_PENDING_STEPS:
            raise RequestError(INCORRECT_STATE, f"{MAX_PENDING_STEPS} calls wait for their steps; wait for an answer")
        self._control.control({"action": "step", "ticks": request.steps})
        pending = PendingResponse()
        self._pending.append(pending)
        left = [request.steps]

        def count(_index: int) -> None:
            left[0] -= 1
            if left[0] <= 0:
                watch.cancel()
                self._settle(pending, answer())

        watch = self._simulation.watch("steps", None, count)
        pending.then(lambda _: watch.cancel())
        return pending

    def current_world(self) -> Answer:
        """Return the present trial."""
        return answer(world=_world(self._world))

    def available_worlds(self, request: OfWorlds) -> Answer:
        """Return the bundled trials with some tags."""
        if request.additional_sources:
            raise RequestError(UNSUPPORTED, "additional_sources: only bundled trials are listed; leave it empty")
        worlds = [_world(name) for name in bundled()]
        return answer(worlds=[each for each in worlds if request.filter.selects(each["tags"])])

    def load_world(self, request: LoadWorld) -> Answer:
        """Load a bundled trial, or one from its text; connections end soon after the answer."""
        if self._load is None:
            raise RequestError(UNSUPPORTED, NO_LOADING)
        if self._is_loading:
            raise RequestError(INCORRECT_STATE, "a world is being loaded")
        name = request.uri or request.world_resource.uri
        text = request.resource_string or request.world_resource.resource_string
        if bool(name) == bool(text):
            raise RequestError(NO_WORLD, "give either uri, a trial of GetAvailableWorlds, or resource_string, its text")
        if name and name not in bundled():
            raise RequestError(NO_WORLD, str(UnknownNameError("trial", name, bundled())))
        try:
            trial = load_trial([find_trial(name)] if name else [], text=text or None).trial
        except CellwrightError as error:
            raise RequestError(WORLD_PARSE_ERROR, str(error)) from None
        self._load(trial)
        self._is_loading = True
        return answer(world=_world(trial.name))

    @property
    def _state(self) -> int:
        if self._is_loading:
            return LOADING
        control = self._control.rate_control
        if not control.is_paused or control.ticks_left:
            return PLAYING
        return PAUSED if self._simulation.clock.tick else STOPPED

    @property
    def _refused(self) -> Mapping[str, str]:
        refused: Mapping[str, str] = self._control.state()["refused"]
        return refused

    def _settle(self, pending: PendingResponse, response: Answer) -> None:
        self._pending.remove(pending)
        pending.answer(response)

    def _interrupt(self, what: str = "reset") -> None:
        for pending in list(self._pending):
            self._settle(pending, answer(FAILED, f"the simulation was {what} meanwhile"))


def _world(name: str) -> Answer:
    tags = [scenario(name)] if name in bundled() else []
    resource = {"uri": name, "resource_string": ""}
    return {"name": name, "world_resource": resource, "description": ", ".join(tags), "tags": tags}
