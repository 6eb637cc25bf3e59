"""Services of worlds under the names of the standard `simulation_interfaces`: trials are worlds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from cellwright.config.trial.catalogue import bundled, bundled_tasks, find_trial, scenario
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.middleware.bus import Node
from cellwright.util.errors import CellwrightError, UnknownNameError
from cellwright.viewer.services.control import Control
from cellwright.viewer.services.simulation_requests import (
    INCORRECT_STATE,
    NO_WORLD_LOADED,
    UNSUPPORTED,
    WORLD_NOT_NAMED,
    WORLD_PARSE_ERROR,
    Answer,
    LoadWorld,
    Method,
    OfWorlds,
    RequestError,
    answer,
)

OF_WORLDS = frozenset({42, 44, 45})
"""Features of trials as worlds: tags, present world, available worlds."""

OF_LOADING = frozenset({40, 41, 43})
"""Features of a session that can load another trial: by name, from its text, and unloading."""

NO_LOADING = (
    "worlds are loaded by `cellwright serve -d` only, without --ros1, --lockstep, --json, a page or output files"
)
"""Reason why a session cannot load another trial."""

UNLOADED = "no world is loaded; load one with LoadWorld"
"""Reason why nothing can be done between two worlds."""


class WorldServices:
    """Services of worlds.

    An unloaded world is reset and stands still, and nothing of it is offered. Another one replaces it.

    Args:
        node: the cell.
        control: its time control.
        load: ends the session soon, and starts another one with a trial; None if that is not possible.

    Attributes:
        is_loaded: True while the cell's own trial is the world.
        is_loading: True from a request to load another one on.
    """

    def __init__(self, node: Node, control: Control, load: Callable[[Trial], None] | None) -> None:
        self._node = node
        self._control = control
        self._load = load
        self.is_loaded, self.is_loading = True, False
        self.public: Mapping[str, Method] = {
            "GetCurrentWorld": (self.current_world, None),
            "GetAvailableWorlds": (self.available_worlds, OfWorlds),
        }
        """Method and request of the services that a competition has too."""
        self.secret: Mapping[str, Method] = {
            "LoadWorld": (self.load_world, LoadWorld),
            "UnloadWorld": (self.unload_world, None),
        }
        """Those that it refuses."""

    @property
    def can_load(self) -> bool:
        """True if worlds can be loaded and unloaded."""
        return self._load is not None

    def guarded(self, methods: Mapping[str, Method]) -> dict[str, Method]:
        """Return methods that refuse every request while no world is loaded."""

        def guard(method: Callable[..., Any]) -> Callable[..., Any]:
            def guarded(*request: Any) -> Any:
                if not self.is_loaded:
                    raise RequestError(INCORRECT_STATE, UNLOADED)
                return method(*request)

            return guarded

        return {name: (guard(method), request) for name, (method, request) in methods.items()}

    def current_world(self) -> Answer:
        """Return the present trial."""
        if not self.is_loaded:
            raise RequestError(NO_WORLD_LOADED, UNLOADED)
        return answer(world=_world(self._node.name))

    def available_worlds(self, request: OfWorlds) -> Answer:
        """Return the bundled trials with some tags."""
        if request.additional_sources:
            raise RequestError(UNSUPPORTED, "additional_sources: only bundled trials are listed; leave it empty")
        worlds = [_world(name) for name in _names()]
        return answer(worlds=[each for each in worlds if request.filter.selects(each["tags"])])

    def load_world(self, request: LoadWorld) -> Answer:
        """Load a bundled trial, or one from its text; connections end soon after the answer."""
        load = self._loader()
        name = request.uri or request.world_resource.uri
        text = request.resource_string or request.world_resource.resource_string
        if not name and not text:
            raise RequestError(
                WORLD_NOT_NAMED, "give either uri, a trial of GetAvailableWorlds, or resource_string, its text"
            )
        if name and name not in _names():
            raise UnknownNameError("trial", name, _names())
        try:
            trial = load_trial([find_trial(name)] if name else [], text=None if name else text).trial
        except CellwrightError as error:
            raise RequestError(WORLD_PARSE_ERROR, str(error)) from None
        load(trial)
        self.is_loaded, self.is_loading = False, True
        return answer(world=_world(trial.name))

    def unload_world(self) -> Answer:
        """Reset the cell, and let it stand until another world is loaded."""
        self._loader()
        if not self.is_loaded:
            raise RequestError(NO_WORLD_LOADED, UNLOADED)
        self._control.control({"action": "reset"})
        self._control.rate_control.pause()
        self._control.over = UNLOADED
        self.is_loaded = False
        return answer()

    def _loader(self) -> Callable[[Trial], None]:
        if self._load is None:
            raise RequestError(UNSUPPORTED, NO_LOADING)
        if self.is_loading:
            raise RequestError(INCORRECT_STATE, "a world is being loaded; wait until it is")
        return self._load


def _names() -> list[str]:
    return [*bundled(), *bundled_tasks()]


def _world(name: str) -> Answer:
    tags = [scenario(name)] if name in _names() else []
    resource = {"uri": name, "resource_string": ""}
    return {"name": name, "world_resource": resource, "description": ", ".join(tags), "tags": tags}
