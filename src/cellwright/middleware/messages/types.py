"""Message and service classes by name, and the two stores that know how they look on a wire."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, partial
from typing import TYPE_CHECKING, cast

from rosbags.interfaces import Nodetype
from rosbags.typesys.store import Typestore
from rosbags.typesys.stores import ros2_kilted

from cellwright.middleware.messages import cellwright_msgs, control_msgs, osrf_gear, std_srvs
from cellwright.middleware.messages.names import MESSAGE, SERVICE, Message, full_name, short_name
from cellwright.middleware.messages.sources import parsed
from cellwright.util.errors import UnknownNameError

if TYPE_CHECKING:
    from rosbags.typesys.store import MsgType

LONGEST_SEQUENCE = 1 << 24
"""More entries in one field are not decoded: no cell sends so many, and a wrong length must not eat the memory."""

HEADER = "std_msgs/msg/Header"
RANGE = "sensor_msgs/msg/Range"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"

OTHERWISE_IN_ROS1 = frozenset(
    f"{package}/msg/{name}"
    for package, names in {
        "sensor_msgs": ("BatteryState", "NavSatStatus"),
        "shape_msgs": ("SolidPrimitive",),
        "stereo_msgs": ("DisparityImage",),
        "visualization_msgs": ("ImageMarker", "Marker"),
    }.items()
    for name in names
)
"""Types whose fields, constants or names changed from ROS 1 to ROS 2, and which no contract here needs in ROS 1."""


@dataclass(frozen=True, slots=True)
class ServiceType:
    """A service by its short name, with the classes of its two halves."""

    name: str
    request: type[Message]
    response: type[Message]


@cache
def own_types() -> dict[str, type[Message]]:
    """The classes that the project brings, by full name."""
    classes = (
        item for module in (cellwright_msgs, control_msgs, osrf_gear, std_srvs) for item in vars(module).values()
    )
    return {
        item.__msgtype__: item
        for item in classes
        if isinstance(item, type) and item.__module__.startswith("cellwright.") and hasattr(item, "__msgtype__")
    }


@cache
def message_type(name: str) -> type[Message]:
    """The class of a message, by its short or full name.

    Raises:
        UnknownNameError: there is no such message; the error lists those of its package.
        UsageError: the name has not the form of a type's name.
    """
    full = full_name(name)
    found = own_types().get(full)
    if found is None and full in ros2_kilted.FIELDDEFS:
        found = getattr(ros2_kilted, full.replace("/", "__"))
    if found is None:
        raise _unknown("message", name, [*own_types(), *ros2_kilted.FIELDDEFS], MESSAGE)
    return found


@cache
def service_type(name: str) -> ServiceType:
    """The classes of a service, by its short or full name.

    Raises:
        UnknownNameError: there is no such service; the error lists those of its package.
        UsageError: the name has not the form of a type's name.
    """
    full = full_name(name, SERVICE)
    own = own_types()
    try:
        return ServiceType(short_name(full), own[f"{full}_Request"], own[f"{full}_Response"])
    except KeyError:
        names = [key.removesuffix("_Request") for key in own if key.endswith("_Request")]
        raise _unknown("service type", name, names, SERVICE) from None


@cache
def ros2_store() -> Typestore:
    """The library's store of ROS 2 forms, with the project's types in it. Made at first use (some 20 ms)."""
    store = Typestore(ros2_kilted, max_sequence_length=LONGEST_SEQUENCE)
    classes = own_types()
    for name, definition in parsed():
        store.fielddefs[name] = definition
        store.types[name] = classes[name]
    return store


@cache
def ros1_store() -> Typestore:
    """A store that writes and reads the same classes in their ROS 1 form.

    Three types have another form there. A header begins with a sequence number, which the classes here do not have:
    zero is written, and what comes is passed over. A range has no variance: it is left out, and zero when it comes.
    The matrices of a camera have names in capitals, and the same bytes.
    """
    ros2 = ros2_store()
    store = Typestore(max_sequence_length=LONGEST_SEQUENCE)
    store.fielddefs = {name: item for name, item in ros2.fielddefs.items() if name not in OTHERWISE_IN_ROS1}
    store.types = {name: item for name, item in ros2.types.items() if name not in OTHERWISE_IN_ROS1}

    constants, fields = ros2.fielddefs[RANGE]
    store.fielddefs[RANGE] = (constants, [field for field in fields if field[0] != "variance"])
    store.types[RANGE] = cast("type[MsgType]", partial(ros2.types[RANGE], variance=0.0))

    plain = store.get_msgdef(HEADER)
    store.cache[HEADER] = replace(
        plain,
        getsize_ros1=lambda pos, message, types: plain.getsize_ros1(pos + 4, message, types),
        serialize_ros1=lambda raw, pos, message, types: plain.serialize_ros1(raw, pos + 4, message, types),
        deserialize_ros1=lambda raw, pos, cls, types: plain.deserialize_ros1(raw, pos + 4, cls, types),
    )
    constants, fields = ros2.fielddefs[HEADER]
    store.fielddefs[HEADER] = (constants, [("seq", (Nodetype.BASE, ("uint32", 0))), *fields])

    store.cache[CAMERA_INFO] = store.get_msgdef(CAMERA_INFO)  # as it is read and written, by the names of the class
    constants, fields = ros2.fielddefs[CAMERA_INFO]
    capitals = [(name.upper() if len(name) == 1 else name, kind) for name, kind in fields]
    store.fielddefs[CAMERA_INFO] = (constants, capitals)
    return store


def _unknown(kind: str, name: str, known: list[str], namespace: str) -> UnknownNameError:
    """The error for an unknown type, with the names of its package, or with the packages when that is unknown too."""
    package = name.partition("/")[0]
    same = sorted({short_name(key) for key in known if key.startswith(f"{package}/{namespace}/")})
    if same:
        return UnknownNameError(kind, name, same)
    return UnknownNameError(f"{kind} package", package, sorted({key.partition("/")[0] for key in known}))
