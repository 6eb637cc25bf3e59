"""Services of the standard `simulation_interfaces`, with JSON in and out: `simulation/GetEntities` and the like.

Requests and responses have the fields of the standard's services, in version 1 or 2. Every response but that of
`GetSimulatorFeatures` has a `result` with a code and an error message. The bridge to ROS 2 offers the same services by
their types; Python needs no ROS for them.

A competition has only those that neither tell where parts are nor change anything. All that `GetSimulatorFeatures` does
not list answers FEATURE_UNSUPPORTED.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Protocol

from cellwright.config.trial.trial import Trial
from cellwright.middleware.bus import ExternalInput, InputKind, Node, PendingResponse
from cellwright.viewer.services.control import MAX_TICKS, Control
from cellwright.viewer.services.entity_services import EntityServices
from cellwright.viewer.services.simulation_requests import (
    ALL,
    ALREADY_THERE,
    FAILED,
    INCORRECT_STATE,
    INCORRECT_TRANSITION,
    PREFIX,
    SPAWNED,
    STATE,
    TIME,
    UNSUPPORTED,
    Answer,
    Method,
    RequestError,
    Scope,
    SetSimulationState,
    Steps,
    answer,
    answered,
)
from cellwright.viewer.services.world_services import OF_LOADING, OF_WORLDS, WorldServices

STOPPED, PLAYING, PAUSED, QUITTING, NO_WORLD, LOADING = range(6)
"""Values of `simulation_interfaces/SimulationState`."""

PUBLIC = frozenset({2, 3, 24, *OF_WORLDS})
"""Features in a competition: named poses and their bounds, state, tags, present and available worlds."""

OF_ENTITIES = frozenset({*range(9), *range(10, 15), 23, 50})
"""Features of a cell: all of entities but models as text, and the reset of what was spawned."""

OF_TIME = frozenset({20, 21, 22, 24, 25, 26, 31, 32, 33})
"""Features of every simulation."""

OF_STEPS = frozenset({31, 32, 33})
"""Features of single steps."""

MAX_PENDING_STEPS = 16
"""Largest number of calls of `StepSimulation` that wait for their last step."""

_REFUSED = {"pause": {25, 26, *OF_STEPS}, "step": OF_STEPS, "reset": {20}, "reset_state": {22}}
"""Features that a session lacks while it refuses an action on time."""


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
        node: the cell or the robot's node.
        control: its time control.
        stop: stops the session.
        entities: services of the cell's entities; None for a robot.
        load: ends the session soon, and starts another one with a trial; None if that is not possible.
        has_clock: False if messages carry wall time, which cannot be reset.
    """

    def __init__(
        self,
        node: Node,
        control: Control,
        *,
        stop: Stoppable,
        entities: EntityServices | None = None,
        load: Callable[[Trial], None] | None = None,
        has_clock: bool = True,
    ) -> None:
        self._node = node
        self._simulation = simulation = node.simulation
        self._control = control
        self._stop = stop
        self._entities = entities
        self._worlds = None if entities is None else WorldServices(node, control, load)
        self._has_clock = has_clock
        self._paused_run: int | None = None
        """The run that was paused on request: before its first tick it is not stopped."""
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
        if self._entities is not None and self._worlds is not None:
            guarded = self._worlds.guarded
            public |= {**guarded(self._entities.public), **self._worlds.public}
            secret |= {**guarded(self._entities.secret), **self._worlds.secret}
        for name, (method, request_class) in public.items():
            server.offer(f"{PREFIX}{name}", partial(answered, method, request_class))
        for name, (method, request_class) in secret.items():
            if self._node.in_competition:
                server.offer(f"{PREFIX}{name}", lambda _request: answer(UNSUPPORTED, "not allowed in a competition"))
            else:
                acts = name == "ResetSimulation" or (self._entities is not None and name in EntityServices.ACTING)
                server.offer(f"{PREFIX}{name}", partial(answered, method, request_class), acts=acts)

    def features(self) -> Answer:
        """Return the features that are available here and now."""
        features = {"features": sorted(self._features), "spawn_formats": [], "custom_info": "Cellwright"}
        return {"features": features}

    def state(self) -> Answer:
        """Return the state of the simulation."""
        return answer(state={"state": self._state})

    def set_state(self, request: SetSimulationState) -> Answer:
        """Pause, resume, stop (reset and pause) or quit."""
        wanted = request.state.state
        if wanted not in range(6):
            raise RequestError(UNSUPPORTED, f"state must be from 0 to 3 (got {wanted})")
        if wanted in (NO_WORLD, LOADING):
            raise RequestError(INCORRECT_TRANSITION, "worlds come and go by LoadWorld and UnloadWorld")
        if self._state == LOADING or (self._state == NO_WORLD and wanted != QUITTING):
            raise RequestError(INCORRECT_TRANSITION, "no world is loaded; load one, or wait until it is loaded")
        is_stepping = self._control.rate_control.is_paused and self._state == PLAYING
        # Steps that run are PLAYING, and may be resumed for good.
        if wanted == self._state and not is_stepping:
            raise RequestError(ALREADY_THERE, "the simulation is in this state already")
        if wanted == QUITTING:
            self._stop.request("a client ended the simulation")
            return answer()
        action = "resume" if wanted == PLAYING else "pause"
        self._require(action, *(("reset",) if wanted == STOPPED else ()))
        if wanted == STOPPED:
            # Before the pause: if it fails, time passes as before.
            self._control.control({"action": "reset"})
        self._control.control({"action": action})
        if wanted == PAUSED:
            self._paused_run = self._simulation.runs
            self._interrupt("paused")  # their steps do not come
        return answer()

    def reset(self, request: Scope) -> Answer:
        """Reset the run, its time, its state, what was spawned, or some of these."""
        scope = (request.scope or ALL) & ALL
        if not scope:
            raise RequestError(UNSUPPORTED, f"scope must have some of 1, 2 and 4 (got {request.scope})")
        if self._state in (NO_WORLD, LOADING):
            raise RequestError(INCORRECT_STATE, "no world is loaded; load one, or wait until it is loaded")
        if scope & TIME and scope != ALL and not self._has_clock:
            raise RequestError(UNSUPPORTED, "messages carry wall time, which is not reset; leave TIME out")
        if scope == SPAWNED and self._entities is None:
            raise RequestError(UNSUPPORTED, "nothing can be spawned here")
        has_spawned = self._entities is not None and bool(self._entities.entities.spawned)
        if scope & TIME and scope & STATE and (scope & SPAWNED or not has_spawned):
            self._require("reset")
            self._control.control({"action": "reset"})
            return answer()
        if scope & STATE:
            self._reset_state(keeps_spawned=not scope & SPAWNED)
        elif scope & SPAWNED and self._entities is not None:
            self._entities.delete_spawned()
        if scope & TIME:
            if scope & STATE:  # another recording has begun
                self._node.bus.note(ExternalInput(InputKind.EXTRA, f"{PREFIX}ResetSimulation", {"scope": TIME}, ""))
            self._simulation.clock.restart_message_time()
        return answer()

    def step(self, request: Steps) -> Answer | PendingResponse:
        """Step a paused simulation; the answer comes after the last step."""
        if self._state in (NO_WORLD, LOADING):
            raise RequestError(INCORRECT_STATE, "no world is loaded; load one, or wait until it is loaded")
        if self._control.state()["lockstep"]:
            raise RequestError(UNSUPPORTED, "in lockstep time passes on request of /cellwright/step")
        self._require("step", "pause")
        rate = self._control.rate_control
        if not rate.is_paused:
            raise RequestError(FAILED, "the simulation is not paused; pause it first")
        if not 1 <= request.steps <= MAX_TICKS:
            raise RequestError(FAILED, f"steps must be from 1 to {MAX_TICKS} (got {request.steps})")
        if len(self._pending) >= MAX_PENDING_STEPS:
            raise RequestError(INCORRECT_STATE, f"{MAX_PENDING_STEPS} calls wait for their steps; wait for an answer")
        self._control.control({"action": "step", "ticks": request.steps})
        pending = PendingResponse()
        self._pending.append(pending)
        # Steps of earlier calls come first.
        left = [rate.ticks_left]

        def count(_index: int) -> None:
            left[0] -= 1
            if left[0] <= 0:
                watch.cancel()
                self._settle(pending, answer())

        watch = self._simulation.watch("steps", None, count)
        pending.then(lambda _: watch.cancel())
        return pending

    @property
    def _features(self) -> frozenset[int]:
        found = OF_TIME if self._entities is None else OF_TIME | OF_ENTITIES | OF_WORLDS
        if self._worlds is not None and self._worlds.can_load:
            found |= OF_LOADING
        for action in self._refused:
            found -= frozenset(_REFUSED.get(action, ()))
        if self._control.state()["lockstep"]:
            found -= OF_STEPS
        if not self._has_clock:
            found -= {21}
        return found & PUBLIC if self._node.in_competition else found

    @property
    def _state(self) -> int:
        if self._worlds is not None and not self._worlds.is_loaded:
            return LOADING if self._worlds.is_loading else NO_WORLD
        control, clock = self._control.rate_control, self._simulation.clock
        if not control.is_paused or control.ticks_left:
            return PLAYING
        is_at_start = not clock.tick and not clock.message_time() and self._paused_run != self._simulation.runs
        return STOPPED if is_at_start else PAUSED

    @property
    def _refused(self) -> Mapping[str, str]:
        refused: Mapping[str, str] = self._control.state()["refused"]
        return refused

    def _require(self, *actions: str) -> None:
        """Refuse a request that needs an action which is refused: its feature is not listed either."""
        for action in actions:
            if action in self._refused:
                raise RequestError(UNSUPPORTED, self._refused[action])

    def _reset_state(self, *, keeps_spawned: bool) -> None:
        self._require("reset_state")
        act = partial(self._control.control, {"action": "reset_state"})
        if keeps_spawned and self._entities is not None:
            self._entities.keep_spawned(act)
        else:
            act()

    def _settle(self, pending: PendingResponse, response: Answer) -> None:
        self._pending.remove(pending)
        pending.answer(response)

    def _interrupt(self, what: str = "reset") -> None:
        for pending in list(self._pending):
            self._settle(pending, answer(FAILED, f"the simulation was {what} meanwhile"))
