"""Message and service types: names, definition files, classes, ROS 1 and ROS 2 stores, checksums.

All functions accept short names ("osrf_gear/Order") and full ones ("osrf_gear/msg/Order"), and return short ones. The
two halves of a service are separate types, "osrf_gear/srv/AGVControl_Request" and "…_Response".

The folder `definitions` contains definitions that ROS 1 and ROS 2 both accept, except for `time` and `duration`.

The ROS 1 checksum of a message is the MD5 of its bare text: constants first, then fields, without comments, and with
each message type replaced by its checksum. The checksum of a service is the MD5 of its two bare texts, joined without
a separator.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache, partial
from hashlib import md5 as hash_md5
from importlib.resources import files
from typing import TYPE_CHECKING, ClassVar, Protocol, cast

from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import Constdefs, Fielddefs
from rosbags.typesys import TypesysError, get_types_from_msg
from rosbags.typesys.store import Typestore
from rosbags.typesys.stores import ros2_kilted

from cellwright.middleware.messages import cellwright_msgs, control_msgs, controller_manager_msgs, osrf_gear, std_srvs
from cellwright.middleware.messages.message_class import MessageClass
from cellwright.util.errors import UnknownNameError, UsageError

if TYPE_CHECKING:
    from rosbags.typesys.store import MsgType

MESSAGE = "msg"
SERVICE = "srv"
EMPTY_FIELDS: Fielddefs = [("structure_needs_at_least_one_member", (Nodetype.BASE, ("uint8", 0)))]
"""Fields of an empty message in ROS 2; ROS 1 sends nothing."""
MAX_SEQUENCE = 1 << 24
"""Most entries of a field that are decoded: no cell sends more, and the limit bounds memory if a length is wrong."""
HEADER = "std_msgs/msg/Header"
RANGE = "sensor_msgs/msg/Range"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"
OTHERWISE_IN_ROS1 = {
    "sensor_msgs/msg/BatteryState",
    "sensor_msgs/msg/NavSatStatus",
    "shape_msgs/msg/SolidPrimitive",
    "stereo_msgs/msg/DisparityImage",
    "visualization_msgs/msg/ImageMarker",
    "visualization_msgs/msg/Marker",
}
"""Types whose fields, constants or names changed from ROS 1 to ROS 2, and which no interface here needs in ROS 1."""
SEPARATOR = "=" * 80
_PRIMITIVE = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
"""Messages of ROS 2 that are built into ROS 1."""


class Message(Protocol):
    """Protocol of message classes: they have a full name."""

    __msgtype__: ClassVar[str]


def full_name(name: str, namespace: str = MESSAGE) -> str:
    """Return the full name of a type.

    Raises:
        UsageError: the name is neither "package/Name" nor "package/msg/Name" (or srv, as `namespace` says).
    """
    match name.split("/"):
        case [package, last] if package and last:
            return f"{package}/{namespace}/{last}"
        case [package, middle, last] if package and last and middle in (namespace, SERVICE):
            return name
        case _:
            raise UsageError(f"{name!r} is not a type name; write it like 'osrf_gear/Order'")


def short_name(name: str) -> str:
    """Return the short name of a type: "osrf_gear/Order"."""
    package, _, rest = name.partition("/")
    return f"{package}/{rest.rpartition('/')[2]}" if rest else package


def type_of(message: Message | type[Message]) -> str:
    """Return the short name of a message's type."""
    return short_name(message.__msgtype__)


@cache
def sources() -> dict[str, str]:
    """Return the text of every definition file by full name ("osrf_gear/msg/Order", "std_srvs/srv/Trigger"), sorted."""
    found = {}
    for package in (files("cellwright.middleware.messages") / "definitions").iterdir():
        for namespace in package.iterdir():
            for file in namespace.iterdir():
                stem, _, ending = file.name.rpartition(".")
                if ending == namespace.name:
                    found[f"{package.name}/{namespace.name}/{stem}"] = file.read_text(encoding="utf-8")
    return dict(sorted(found.items()))


def parsed_definitions() -> Iterator[tuple[str, tuple[Constdefs, Fielddefs]]]:
    """Yield every type of the definition files, with its constants and fields; a service has two types."""
    for name, text in sources().items():
        package, namespace, last = name.split("/")
        if namespace == MESSAGE:
            yield name, _parse_definition(text, package, last)
        else:
            request, _, response = text.partition("---\n")
            yield f"{name}_Request", _parse_definition(request, package, last)
            yield f"{name}_Response", _parse_definition(response, package, last)


def _parse_definition(text: str, package: str, last: str) -> tuple[Constdefs, Fielddefs]:
    name = f"{package}/msg/{last}"  # looks bare type names up in its own package
    constants, fields = get_types_from_msg(text, name)[name]
    return constants, fields or EMPTY_FIELDS


@dataclass(frozen=True, slots=True)
class ServiceType:
    """Type of a service: its short name, and the classes of its two halves."""

    name: str
    request: type[Message]
    response: type[Message]


@cache
def own_types() -> dict[str, type[Message]]:
    """Return the classes that Cellwright defines, by full name."""
    modules = (cellwright_msgs, control_msgs, controller_manager_msgs, osrf_gear, std_srvs)
    classes = (item for module in modules for item in vars(module).values() if isinstance(item, type))
    return {item.__msgtype__: item for item in classes if issubclass(item, MessageClass) and item is not MessageClass}


@cache
def message_type(name: str) -> type[Message]:
    """Return the class of a message, by its short or full name.

    Raises:
        UnknownNameError: there is no such message; the error lists those of its package.
        UsageError: the name is not of the form of a type name.
    """
    full = full_name(name)
    found = own_types().get(full)
    if found is None and full in ros2_kilted.FIELDDEFS:
        found = getattr(ros2_kilted, full.replace("/", "__"))
    if found is None:
        raise _unknown_type("message", name, [*own_types(), *ros2_kilted.FIELDDEFS], MESSAGE)
    return found


@cache
def service_type(name: str) -> ServiceType:
    """Return the classes of a service, by its short or full name.

    Raises:
        UnknownNameError: there is no such service; the error lists those of its package.
        UsageError: the name is not of the form of a type name.
    """
    full = full_name(name, SERVICE)
    own = own_types()
    try:
        return ServiceType(short_name(full), own[f"{full}_Request"], own[f"{full}_Response"])
    except KeyError:
        names = [key.removesuffix("_Request") for key in own if key.endswith("_Request")]
        raise _unknown_type("service type", name, names, SERVICE) from None


@cache
def ros2_store() -> Typestore:
    """Return the library's store of ROS 2 types, with Cellwright's added. It is built at first use (some 20 ms)."""
    store = Typestore(ros2_kilted, max_sequence_length=MAX_SEQUENCE)
    classes = own_types()
    for name, definition in parsed_definitions():
        store.fielddefs[name] = definition
        store.types[name] = classes[name]
    return store


@cache
def ros1_store() -> Typestore:
    """Return a store that writes and reads the same classes in their ROS 1 form.

    Three types have another form there. A header begins with a sequence number, which the classes here do not have: the
    store writes zero, and ignores it when reading. A range has no variance: it is not written, and zero when read. The
    matrices of a camera have names in capitals, and the same bytes.
    """
    ros2 = ros2_store()
    store = Typestore(max_sequence_length=MAX_SEQUENCE)
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

    store.cache[CAMERA_INFO] = store.get_msgdef(CAMERA_INFO)  # by the class's names, for reading and writing
    constants, fields = ros2.fielddefs[CAMERA_INFO]
    capitals = [(name.upper() if len(name) == 1 else name, kind) for name, kind in fields]
    store.fielddefs[CAMERA_INFO] = (constants, capitals)
    return store


def _unknown_type(kind: str, name: str, known: list[str], namespace: str) -> UnknownNameError:
    """Return the error for an unknown type; it lists the names of its package, or the packages if that is unknown."""
    package = name.partition("/")[0]
    same = sorted({short_name(key) for key in known if key.startswith(f"{package}/{namespace}/")})
    if same:
        return UnknownNameError(kind, name, same)
    return UnknownNameError(f"{kind} package", package, sorted({key.partition("/")[0] for key in known}))


@cache
def md5(name: str) -> str:
    """Return the ROS 1 checksum of a message or service, by its short or full name; no name stands for both.

    Raises:
        UnknownNameError: there is neither a message nor a service of this name.
        UsageError: the type has another form in ROS 1 that is not supported.
    """
    try:
        return _generated(message_type(name).__msgtype__)[1]
    except UnknownNameError as no_message:
        try:
            service = service_type(name)
        except (UnknownNameError, UsageError):
            raise no_message from None
        text = _bare_text(service.request.__msgtype__) + _bare_text(service.response.__msgtype__)
        return hash_md5(text.encode(), usedforsecurity=False).hexdigest()


@cache
def definition(name: str) -> str:
    """Return the full ROS 1 definition of a message, with the types in it, as in connection headers and bags.

    It is that of ROS 1 itself, with comments: `rosbag check` compares the texts. Types that Cellwright has no text of
    have one without comments.

    Raises:
        UnknownNameError: there is no such message.
        UsageError: the type has another form in ROS 1 that is not supported.
    """
    full = message_type(name).__msgtype__
    bare, texts = _generated(full)[0], ros1_texts()
    _, *others = bare.split(f"{SEPARATOR}\n")
    embedded = [full_name(each.partition("\n")[0].removeprefix("MSG: ")) for each in others]
    if not all(each in texts for each in (full, *embedded)):
        return bare
    parts = [f"MSG: {short_name(each)}\n{texts[each]}\n" for each in _embedded_types(full)]
    return f"{SEPARATOR}\n".join([f"{texts[full]}\n", *parts])[:-1]


@cache
def ros1_texts() -> dict[str, str]:
    """Return the ROS 1 text of each message, by full name: of ROS's own, and of Cellwright's definition files."""
    root = files("cellwright.middleware.messages") / "ros1_texts"
    found = {
        f"{package.name}/{MESSAGE}/{file.name.removesuffix('.msg')}": file.read_bytes().decode()
        for package in root.iterdir()
        if package.is_dir()
        for file in package.iterdir()
    }
    return found | {name: text for name, text in sources().items() if name.split("/")[1] == MESSAGE}


def _embedded_types(full: str) -> list[str]:
    """Return the types within a message, each once, in the order of ROS 1: depth first."""
    found: dict[str, None] = {}
    for _, (kind, content) in ros1_store().fielddefs[full][1]:
        # an array has the description of its members, and its length
        member = cast(
            "tuple[Nodetype, object]", content[0] if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE) else (kind, content)
        )
        if member[0] == Nodetype.NAME and member[1] not in _PRIMITIVE:
            found |= dict.fromkeys([str(member[1]), *_embedded_types(str(member[1]))])
    return list(found)


@cache
def _generated(full: str) -> tuple[str, str]:
    """Return the full definition of a message, and its checksum."""
    try:
        return ros1_store().generate_msgdef(full, ros_version=1)
    except TypesysError:
        raise UsageError(f"{short_name(full)} has different fields in ROS 1 and is not supported there") from None


def _bare_text(full: str) -> str:
    """Return the text for the checksum of one half of a service, which the library does not know."""
    lines = []
    for line in _generated(full)[0].split(SEPARATOR)[0].splitlines():
        kind, _, rest = line.partition(" ")
        package_type = kind.partition("[")[0]
        lines.append(f"{_generated(full_name(package_type))[1]} {rest}" if "/" in package_type else line)
    return "\n".join(lines)
