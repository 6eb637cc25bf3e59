"""Services of a cell's entities under the names of the standard `simulation_interfaces`, with JSON in and out."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from cellwright.cell.entities import Box, Category, Entities, EntityInfo, EntityState
from cellwright.util.errors import RejectedCommandError, UnknownNameError
from cellwright.util.pose import Pose
from cellwright.viewer.services.simulation_requests import (
    BOX,
    EMPTY,
    FAILED,
    INVALID_POSE,
    NAME_INVALID,
    NAME_NOT_UNIQUE,
    NAMESPACE_INVALID,
    NO_RESOURCE,
    PREFIX,
    SPAWN_POSE_INVALID,
    SPAWNED,
    UNSUPPORTED_FORMAT,
    Answer,
    Filters,
    Header,
    Method,
    OfEntity,
    OfFilters,
    OfName,
    OfTags,
    RequestError,
    Scope,
    SetInfo,
    SetState,
    Spawn,
    answer,
    answered,
    expression,
    region,
)

if TYPE_CHECKING:
    from cellwright.cell.cell import Cell


class EntityServices:
    """Services of a cell's entities. `handlers` has those of a development cell by name, `ACTING` those that act."""

    ACTING = frozenset({"SpawnEntity", "DeleteEntity", "SetEntityState", "ResetSimulation"})

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
            "GetSpawnables": (self.spawnables, None),
            "SpawnEntity": (self.spawn, Spawn),
            "DeleteEntity": (self.delete, OfEntity),
        }
        """Those that it refuses."""

    def replayed(self) -> dict[str, Callable[[Answer], Any]]:
        """Return the handlers of recorded requests that change the cell, by name."""
        found = {**self.secret, "ResetSimulation": (self.delete_spawned, Scope)}
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

    def spawnables(self) -> Answer:
        """Return the part types; one with waiting parts can be spawned."""
        waiting = self.entities.spawnable()
        return answer(
            spawnables=[
                {
                    "uri": kind,
                    "entity_resource": {"uri": kind, "resource_string": ""},
                    "description": f"part; {waiting[kind]} wait",
                    "spawn_bounds": _bounds(None),
                }
                for kind in waiting
            ]
        )

    def spawn(self, request: Spawn) -> Answer:
        """Put a waiting part into play."""
        kind = request.uri or request.entity_resource.uri
        if request.resource_string or request.entity_resource.resource_string:
            raise RequestError(UNSUPPORTED_FORMAT, "resource_string: models cannot be added to a run; name a part type")
        if request.entity_namespace:
            raise RequestError(NAMESPACE_INVALID, "entity_namespace: a part has no topics; leave it empty")
        if not kind:
            raise RequestError(NO_RESOURCE, "uri is empty; name a part type of GetSpawnables")
        waiting = self.entities.spawnable()
        if kind not in waiting:
            raise RequestError(NO_RESOURCE, f"uri: no part of type {kind!r:.60} waits; there are {', '.join(waiting)}")
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

    def delete(self, request: OfEntity) -> Answer:
        """Take a part out of the cell."""
        self.entities.delete(request.entity)
        return answer()

    def delete_spawned(self, request: Scope) -> Answer:
        """Take all spawned parts out of the cell, if the scope is these alone."""
        if request.scope == SPAWNED:
            for name in self.entities.spawned:
                self.entities.delete(name)
        return answer()

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
            contains = region(filters.bounds)
            names = [name for name in names if contains(np.array(entities.state(name).pose.position))]
        return names

    def _state(self, name: str) -> Answer:
        state: EntityState = self.entities.state(name)
        seconds, rest = divmod(self._cell.simulation.clock.message_time(), 1_000_000_000)
        return {
            "header": {"stamp": {"sec": seconds, "nanosec": rest}, "frame_id": "world"},
            "pose": _pose(state.pose),
            "twist": {"linear": _vector(state.linear), "angular": _vector(state.angular)},
        }

    def _frame(self, header: Header, code: int) -> Pose:
        frames = self.entities.frames()
        name = header.frame_id or "world"
        if name not in frames:
            raise RequestError(code, str(UnknownNameError("fixed frame", name, frames)))
        return frames[name]


def _vector(values: Iterable[float]) -> Answer:
    return dict(zip("xyz", map(float, values), strict=True))


def _pose(pose: Pose) -> Answer:
    w, x, y, z = map(float, pose.quaternion)
    return {"position": _vector(pose.position), "orientation": {"x": x, "y": y, "z": z, "w": w}}


def _bounds(box: Box | None) -> Answer:
    if box is None:
        return {"type": EMPTY, "points": []}
    return {"type": BOX, "points": [_vector(box.upper), _vector(box.lower)]}
