"""Requests of the standard `simulation_interfaces` as classes, and its codes.

The fields are those of version 1; those that version 2 adds have defaults.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, TypeAlias

import msgspec

from cellwright.util.errors import CellwrightError, RejectedCommandError, UnknownNameError
from cellwright.util.pose import Pose, Vector3

PREFIX = "simulation/"
"""Prefix of the services' names on the server."""

UNSUPPORTED, OK, NOT_FOUND, INCORRECT_STATE, FAILED = range(5)
"""Codes of `simulation_interfaces/Result`."""

ALREADY_THERE, INCORRECT_TRANSITION = 101, 103
INVALID_POSE = 101
NO_WORLD_LOADED = 101
WORLD_NOT_NAMED, WORLD_PARSE_ERROR = 102, 103
NAME_NOT_UNIQUE, NAME_INVALID, NO_RESOURCE, NAMESPACE_INVALID, SPAWN_POSE_INVALID = 101, 102, 104, 105, 109
SPAWN_FAILED = 150
"""Further codes of `SetSimulationState`, `SetEntityState`, worlds, `SpawnEntity` and `SpawnEntities`."""

TIME, STATE, SPAWNED = 1, 2, 4
ALL = TIME | STATE | SPAWNED
"""Scopes of `ResetSimulation`; the standard's own number for all has further bits."""

EMPTY, BOX, HULL, SPHERE = range(4)
"""Types of `simulation_interfaces/Bounds`."""

Answer: TypeAlias = dict[str, Any]

Method: TypeAlias = tuple[Callable[..., Any], type[Any] | None]
"""Method of a service, and the class of its request; None for an empty one."""


class Vector(msgspec.Struct):
    """A geometry_msgs/Vector3 or Point."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0

    @property
    def values(self) -> Vector3:
        """The three numbers."""
        return self.x, self.y, self.z


class Turn(Vector):
    """A geometry_msgs/Quaternion."""

    w: float = 1.0


class PoseFields(msgspec.Struct):
    """A geometry_msgs/Pose."""

    position: Vector = msgspec.field(default_factory=Vector)
    orientation: Turn = msgspec.field(default_factory=Turn)

    @property
    def value(self) -> Pose:
        """The pose."""
        return Pose(self.position.values, (self.orientation.w, *self.orientation.values))


class Header(msgspec.Struct):
    """A std_msgs/Header."""

    frame_id: str = ""


class PoseStamped(msgspec.Struct):
    """A geometry_msgs/PoseStamped."""

    header: Header = msgspec.field(default_factory=Header)
    pose: PoseFields = msgspec.field(default_factory=PoseFields)


class Twist(msgspec.Struct):
    """A geometry_msgs/Twist."""

    linear: Vector = msgspec.field(default_factory=Vector)
    angular: Vector = msgspec.field(default_factory=Vector)


class StateFields(msgspec.Struct):
    """A simulation_interfaces/EntityState."""

    header: Header = msgspec.field(default_factory=Header)
    pose: PoseFields = msgspec.field(default_factory=PoseFields)
    twist: Twist = msgspec.field(default_factory=Twist)


class CategoryFields(msgspec.Struct):
    """A simulation_interfaces/EntityCategory."""

    category: int = 0


class InfoFields(msgspec.Struct):
    """A simulation_interfaces/EntityInfo."""

    category: CategoryFields = msgspec.field(default_factory=CategoryFields)
    description: str = ""
    tags: list[str] = []


class TagsFilter(msgspec.Struct):
    """A simulation_interfaces/TagsFilter."""

    tags: list[str] = []
    filter_mode: int = 0

    def selects(self, tags: Iterable[str]) -> bool:
        """Return whether something with these tags is selected."""
        found = set(tags)
        return not self.tags or (any, all)[self.filter_mode == 1](tag in found for tag in self.tags)


class BoundsFields(msgspec.Struct):
    """A simulation_interfaces/Bounds."""

    type: int = EMPTY
    points: list[Vector] = []


class Filters(msgspec.Struct):
    """A simulation_interfaces/EntityFilters."""

    filter: str = ""
    categories: list[CategoryFields] = []
    tags: TagsFilter = msgspec.field(default_factory=TagsFilter)
    bounds: BoundsFields = msgspec.field(default_factory=BoundsFields)


class Resource(msgspec.Struct):
    """A simulation_interfaces/Resource."""

    uri: str = ""
    resource_string: str = ""


class OfFilters(msgspec.Struct):
    """Request of GetEntities and GetEntitiesStates."""

    filters: Filters = msgspec.field(default_factory=Filters)


class OfEntity(msgspec.Struct):
    """Request about one entity."""

    entity: str


class SetState(OfEntity):
    """Request of SetEntityState; version 2 names what is set."""

    state: StateFields = msgspec.field(default_factory=StateFields)
    set_pose: bool = True
    set_twist: bool = True


class SetInfo(OfEntity):
    """Request of SetEntityInfo."""

    info: InfoFields = msgspec.field(default_factory=InfoFields)


class Spawn(msgspec.Struct):
    """Request of SpawnEntity; version 2 has the resource as a message."""

    name: str = ""
    allow_renaming: bool = False
    uri: str = ""
    resource_string: str = ""
    entity_resource: Resource = msgspec.field(default_factory=Resource)
    entity_namespace: str = ""
    initial_pose: PoseStamped = msgspec.field(default_factory=PoseStamped)

    @property
    def resource(self) -> Resource:
        """Requested resource, in either version; a text counts only without a URI."""
        return Resource(
            self.uri or self.entity_resource.uri, self.resource_string or self.entity_resource.resource_string
        )


class SpawnMany(msgspec.Struct):
    """Request of SpawnEntities."""

    spawn_requests: list[Spawn] = []


class OfSources(msgspec.Struct):
    """Request of GetSpawnables."""

    sources: list[str] = []


class OfTags(msgspec.Struct):
    """Request of GetNamedPoses."""

    tags: TagsFilter = msgspec.field(default_factory=TagsFilter)


class OfName(msgspec.Struct):
    """Request of GetNamedPoseBounds."""

    name: str


class OfWorlds(msgspec.Struct):
    """Request of GetAvailableWorlds."""

    filter: TagsFilter = msgspec.field(default_factory=TagsFilter)
    additional_sources: list[str] = []


class LoadWorld(msgspec.Struct):
    """Request of LoadWorld; version 2 has the world as a message."""

    uri: str = ""
    resource_string: str = ""
    world_resource: Resource = msgspec.field(default_factory=Resource)


class StateValue(msgspec.Struct):
    """A simulation_interfaces/SimulationState."""

    state: int


class SetSimulationState(msgspec.Struct):
    """Request of SetSimulationState."""

    state: StateValue


class Scope(msgspec.Struct):
    """Request of ResetSimulation."""

    scope: int = 0


class Steps(msgspec.Struct):
    """Request of StepSimulation."""

    steps: int = 1


class RequestError(RejectedCommandError):
    """A request that is refused with one of the standard's codes."""

    def __init__(self, code: int, reason: str) -> None:
        super().__init__(reason)
        self.code = code


def answer(code: int = OK, reason: str = "", **fields: Any) -> Answer:
    """Return a response with its result."""
    return {"result": {"result": code, "error_message": reason}, **fields}


def answered(method: Callable[..., Any], request_class: type[Any] | None, request: Answer) -> Any:
    """Return the response of a method; what it refuses becomes a result with the fitting code."""
    try:
        if request_class is None:
            return method()
        return method(msgspec.convert(request, request_class))
    except RequestError as error:
        return answer(error.code, str(error))
    except UnknownNameError as error:
        return answer(NOT_FOUND, str(error))
    except (CellwrightError, msgspec.ValidationError) as error:
        return answer(FAILED, str(error))
