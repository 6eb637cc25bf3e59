"""Services of a cell's entities under the names of the standard `simulation_interfaces`, with JSON in and out."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from functools import partial
from typing import TYPE_CHECKING, Any

from cellwright.cell.entities import Category, Entities, EntityInfo, EntityState
from cellwright.cell.named_poses import Box
from cellwright.middleware.bus import ExternalInput, InputKind
from cellwright.util.errors import RejectedCommandError, UnknownNameError
from cellwright.util.pose import Pose
from cellwright.viewer.services.entity_filters import expression, overlapping
from cellwright.viewer.services.simulation_requests import (
    BOX,
    EMPTY,
    FAILED,
    INVALID_POSE,
    NAME_INVALID,
    NAME_NOT_UNIQUE,
    NAMESPACE_INVALID,
    NO_RESOURCE,
    OK,
    PREFIX,
    SPAWN_FAILED,
    SPAWN_POSE_INVALID,
    SPAWNED,
    STATE,
    TIME,
    UNSUPPORTED,
    Answer,
    Filters,
    Header,
    Method,
    OfEntity,
    OfFilters,
    OfName,
    OfSources,
    OfTags,
    RequestError,
    Scope,
    SetInfo,
    SetState,
    Spawn,
    SpawnMany,
    answer,
    answered,
)

if TYPE_CHECKING:
    from cellwright.cell.cell import Cell

_NAMESPACE = re.compile(r"/?[A-Za-z_~]\w*(/[A-Za-z_]\w*)*/?|/?", re.ASCII)
"""Namespaces of ROS."""


class EntityServices:
    """Services of a cell's entities. `handlers` has those of a development cell by name, `ACTING` those that act."""

    ACTING = frozenset({"SpawnEntity", "SpawnEntities", "DeleteEntity", "SetEntityState", "ResetSimulation"})

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        self.entities = Entities(cell)
        self.public: dict[str, Method] = {
            "GetNamedPoses": (self.named_poses, OfTags),
            "GetNamedPoseBounds": (self.named_pose_bounds, OfName),
        }
        """Method and request of the services that a competition has too."""
        self.secret: dict[str, Method] = {
            "GetEntities": (self.names, OfFilters),
            "GetEntitiesStates": (self.states, OfFilters),
            "GetEntityInfo": (self.info, OfEntity),
            "SetEntityInfo": (self.set_info, SetInfo),
            "GetEntityState": (self.state, OfEntity),
            "SetEntityState": (self.set_state, SetState),
            "GetEntityBounds": (self.bounds, OfEntity),
            "GetSpawnables": (self.spawnables, OfSources),
            "SpawnEntity": (self.spawn, Spawn),
            "SpawnEntities": (self.spawn_many, SpawnMany),
            "DeleteEntity": (self.delete, OfEntity),
        }
        """Those that it refuses."""

    def replayed(self) -> dict[str, Callable[[Answer], Any]]:
        """Return the handlers of recorded requests that change the cell, by name."""
        found = {**self.secret, "ResetSimulation": (self.reset_again, Scope)}
        return {f"{PREFIX}{name}": partial(answered, *found[name]) for name in sorted(self.ACTING)}

    def names(self, request: OfFilters) -> Answer:
        """Return the names of the selected entities."""
        return answer(entities=self._selected(request.filters))

    def states(self, request: OfFilters) -> Answer:
        """Return names and states of the selected entities."""
        names = self._selected(request.filters)
        return answer(entities=names, states=[self._state(name) for name in names])

    def info(self, request: OfEntity) -> Answer:
        """Return the description of an entity."""
        info = self.entities.info(request.entity)
        category = {"category": int(info.category)}
        return answer(info={"category": category, "description": info.description, "tags": list(info.tags)})

    def set_info(self, request: SetInfo) -> Answer:
        """Replace the description of an entity."""
        number = request.info.category.category
        if number not in list(Category):
            raise RequestError(
                FAILED, f"category must be one of {', '.join(map(str, map(int, Category)))} (got {number})"
            )
        info = EntityInfo(Category(number), request.info.description, tuple(request.info.tags))
        self.entities.set_info(request.entity, info)
        return answer()

    def state(self, request: OfEntity) -> Answer:
        """Return pose and velocity of an entity."""
        return answer(state=self._state(request.entity))

    def set_state(self, request: SetState) -> Answer:
        """Place a part, and set its velocity."""
        state = request.state
        world_T_frame = self._frame(state.header, INVALID_POSE)
        pose = world_T_frame @ state.pose.value if request.set_pose else None
        linear, angular = (world_T_frame.rotate(each.values) for each in (state.twist.linear, state.twist.angular))
        try:
            self.entities.set_state(request.entity, pose, (linear, angular) if request.set_twist else None)
        except RejectedCommandError as error:
            raise RequestError(INVALID_POSE if "pose" in str(error) else FAILED, str(error)) from None
        return answer()

    def bounds(self, request: OfEntity) -> Answer:
        """Return the box around an entity, in the world frame."""
        return answer(bounds=_bounds(self.entities.bounds(request.entity)))

    def spawnables(self, request: OfSources) -> Answer:
        """Return the part types; one with waiting parts can be spawned. There are no further sources."""
        waiting = self.entities.spawnable()
        unknown = f"unknown sources: {', '.join(request.sources):.200}" if request.sources else ""
        return answer(
            OK,
            unknown,
            spawnables=[
                {
                    "uri": kind,
                    "entity_resource": {"uri": kind, "resource_string": ""},
                    "description": f"part; {waiting[kind]} wait",
                    "spawn_bounds": _bounds(None),
                }
                for kind in waiting
            ],
        )

    def spawn(self, request: Spawn) -> Answer:
        """Put a waiting part into play. A namespace has no effect, since a part has no topics."""
        kind = self._spawnable(request)
        if not _NAMESPACE.fullmatch(request.entity_namespace):
            raise RequestError(NAMESPACE_INVALID, f"entity_namespace: no name (got {request.entity_namespace!r:.60})")
        name = request.name
        if name in self.entities.names():
            if not request.allow_renaming:
                raise RequestError(NAME_NOT_UNIQUE, f"name: {name} exists already")
            name = ""
        pose = self._frame(request.initial_pose.header, SPAWN_POSE_INVALID) @ request.initial_pose.pose.value
        try:
            given = self.entities.spawn(kind, name, pose)
        except UnknownNameError as error:
            if not request.allow_renaming:
                raise RequestError(NAME_INVALID, f"name: {error}; leave it empty, or allow renaming") from None
            given = self.entities.spawn(kind, "", pose)
        except RejectedCommandError as error:
            raise RequestError(SPAWN_POSE_INVALID, str(error)) from None
        return answer(entity_name=given)

    def spawn_many(self, request: SpawnMany) -> Answer:
        """Put several waiting parts into play, each on its own."""
        results = []
        for each in request.spawn_requests:
            result = answered(lambda each=each: self.spawn(each), None, {})
            results.append({"entity_name": "", **result})
        failed = sum(each["result"]["result"] != OK for each in results)
        if failed:
            return answer(SPAWN_FAILED, f"{failed} of {len(results)} were not spawned; see results", results=results)
        return answer(results=results)

    def delete(self, request: OfEntity) -> Answer:
        """Take a part out of the cell."""
        self.entities.delete(request.entity)
        return answer()

    def reset_again(self, request: Scope) -> Answer:
        """Repeat what a recorded reset did to this run, which goes on: one of the state began another recording."""
        if request.scope & (STATE | SPAWNED) == SPAWNED:
            self.delete_spawned()
        if request.scope & (STATE | TIME) == TIME:
            self._cell.simulation.clock.restart_message_time()
        return answer()

    def delete_spawned(self) -> None:
        """Take all spawned parts out of the cell."""
        for name in self.entities.spawned:
            self.entities.delete(name)

    def keep_spawned(self, act: Callable[[], object]) -> None:
        """Reset the state by `act`; spawned parts then appear again where they appeared first."""
        spawned = self.entities.spawned
        act()
        for name, (kind, pose) in spawned.items():
            # A part of the trial is there again, at its own place.
            if name not in self.entities.names():
                request = {"name": name, "uri": kind, "initial_pose": {"pose": _pose(pose)}}
                self._cell.bus.note(ExternalInput(InputKind.EXTRA, f"{PREFIX}SpawnEntity", request, ""))
                self.entities.spawn(kind, name, pose)

    def named_poses(self, request: OfTags) -> Answer:
        """Return the named poses with some tags."""
        return answer(
            poses=[
                {"name": each.name, "description": each.description, "tags": list(each.tags), "pose": _pose(each.pose)}
                for each in self.entities.named_poses()
                if request.tags.selects(each.tags)
            ]
        )

    def named_pose_bounds(self, request: OfName) -> Answer:
        """Return the free space over a named pose."""
        found = {each.name: each for each in self.entities.named_poses()}
        if request.name not in found:
            raise UnknownNameError("named pose", request.name, found)
        return answer(bounds=_bounds(found[request.name].space))

    def _selected(self, filters: Filters) -> list[str]:
        entities = self.entities
        names = entities.names()
        if filters.filter:
            pattern = expression(filters.filter)
            names = [name for name in names if pattern.search(name)]
        if filters.categories:
            categories = {each.category for each in filters.categories}
            names = [name for name in names if entities.info(name).category in categories]
        if filters.tags.tags:
            names = [name for name in names if filters.tags.selects(entities.info(name).tags)]
        if filters.bounds.type != EMPTY:
            simulation = self._cell.simulation
            simulation.refresh()
            shapes = {name: entities.solids(name) or entities.state(name).pose.position for name in names}
            found = overlapping(filters.bounds, simulation.model, simulation.data, shapes)
            names = [name for name in names if name in found]
        return names

    def _state(self, name: str) -> Answer:
        state: EntityState = self.entities.state(name)
        seconds, rest = divmod(self._cell.simulation.clock.message_time(), 1_000_000_000)
        return {
            "header": {"stamp": {"sec": seconds, "nanosec": rest}, "frame_id": "world"},
            "pose": _pose(state.pose),
            "twist": {"linear": _vector(state.linear), "angular": _vector(state.angular)},
            "acceleration": {
                "linear": _vector(state.linear_acceleration),
                "angular": _vector(state.angular_acceleration),
            },
        }

    def _spawnable(self, request: Spawn) -> str:
        """Return the requested part type, of which a part waits."""
        resource, waiting = request.resource, self.entities.spawnable()
        if resource.uri in waiting:
            return resource.uri
        if resource.uri in self.entities.types:
            raise RequestError(FAILED, f"uri: no part of type {resource.uri} waits; delete one, or spawn another type")
        if resource.uri:
            raise UnknownNameError("part type", resource.uri, waiting)
        if resource.resource_string:
            raise RequestError(UNSUPPORTED, "resource_string: models cannot be added to a run; name a part type")
        raise RequestError(NO_RESOURCE, "uri: is empty; name a part type of GetSpawnables")

    def _frame(self, header: Header, code: int) -> Pose:
        try:
            return self.entities.frame(header.frame_id or "world")
        except UnknownNameError as error:
            raise RequestError(code, f"frame_id: {error}") from None


def _vector(values: Iterable[float]) -> Answer:
    return dict(zip("xyz", map(float, values), strict=True))


def _pose(pose: Pose) -> Answer:
    w, x, y, z = map(float, pose.quaternion)
    return {"position": _vector(pose.position), "orientation": {"x": x, "y": y, "z": z, "w": w}}


def _bounds(box: Box | None) -> Answer:
    if box is None:
        return {"type": EMPTY, "points": []}
    return {"type": BOX, "points": [_vector(box.upper), _vector(box.lower)]}
