"""ROS 1 form of messages: as bytes, as text and as checksum.

The checksum of a message is the MD5 of its bare text: constants first, then fields, without comments, and with each
message type replaced by its checksum. The checksum of a service is the MD5 of its two bare texts, joined without a
separator.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache, partial
from hashlib import md5
from importlib.resources import files
from typing import TYPE_CHECKING, cast

from rosbags.interfaces import Nodetype
from rosbags.typesys import TypesysError
from rosbags.typesys.store import Typestore

from cellwright.middleware.messages.message_class import MESSAGE, full_name, short_name
from cellwright.util.errors import UsageError

if TYPE_CHECKING:
    from rosbags.typesys.store import MsgType

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


class Ros1Form:
    """ROS 1 form of a set of types. All methods take full names.

    Args:
        ros2: the types in their ROS 2 form.
        sources: texts of Cellwright's definition files by full name.
    """

    def __init__(self, ros2: Typestore, sources: Mapping[str, str]) -> None:
        self.store = ros1_store(ros2)
        self._sources = sources
        self._generated = cache(self._generate)

    def require(self, name: str) -> None:
        """Raise a UsageError for a type that has another form in ROS 1."""
        try:
            self.store.get_msgdef(name)
        except (KeyError, TypesysError):
            raise _unsupported(name) from None

    def message_md5(self, name: str) -> str:
        """Return the checksum of a message; a UsageError if its ROS 1 form is not supported."""
        return self._generated(name)[1]

    def service_md5(self, request: str, response: str) -> str:
        """Return the checksum of a service, of its two halves; a UsageError if its ROS 1 form is not supported."""
        text = self._bare_text(request) + self._bare_text(response)
        return md5(text.encode(), usedforsecurity=False).hexdigest()

    def definition(self, name: str) -> str:
        """Return the full definition of a message, with the types in it; see `TypeSet.definition`."""
        # ROS's own text has comments. It is used if there is one for every type within, in ROS's own order.
        bare, texts = self._generated(name)[0], self.texts()
        _, *others = bare.split(f"{SEPARATOR}\n")
        embedded = [full_name(each.partition("\n")[0].removeprefix("MSG: ")) for each in others]
        if not all(each in texts for each in (name, *embedded)):
            return bare
        parts = [f"MSG: {short_name(each)}\n{texts[each]}\n" for each in self._embedded_types(name)]
        return f"{SEPARATOR}\n".join([f"{texts[name]}\n", *parts])[:-1]

    def texts(self) -> dict[str, str]:
        """Return the text of each message: of ROS's own, and of the definition files."""
        return _ros_texts() | {name: text for name, text in self._sources.items() if name.split("/")[1] == MESSAGE}

    def _embedded_types(self, name: str) -> list[str]:
        """Return the types within a message, each once, in the order of ROS 1: depth first."""
        found: dict[str, None] = {}
        for _, (kind, content) in self.store.fielddefs[name][1]:
            # an array has the description of its members, and its length
            member = cast(
                "tuple[Nodetype, object]",
                content[0] if kind in (Nodetype.ARRAY, Nodetype.SEQUENCE) else (kind, content),
            )
            if member[0] == Nodetype.NAME and member[1] not in _PRIMITIVE:
                found |= dict.fromkeys([str(member[1]), *self._embedded_types(str(member[1]))])
        return list(found)

    def _generate(self, name: str) -> tuple[str, str]:
        """Return the full definition of a message, and its checksum."""
        try:
            return self.store.generate_msgdef(name, ros_version=1)
        except TypesysError:
            raise _unsupported(name) from None

    def _bare_text(self, name: str) -> str:
        """Return the text for the checksum of one half of a service, which the library does not know."""
        lines = []
        for line in self._generated(name)[0].split(SEPARATOR)[0].splitlines():
            kind, _, rest = line.partition(" ")
            package_type = kind.partition("[")[0]
            lines.append(f"{self._generated(full_name(package_type))[1]} {rest}" if "/" in package_type else line)
        return "\n".join(lines)


def ros1_store(ros2: Typestore) -> Typestore:
    """Return a store that writes and reads the same classes in their ROS 1 form.

    Three types have another form there. A header begins with a sequence number, which the classes here do not have: the
    store writes zero, and ignores it when reading. A range has no variance: it is not written, and zero when read. The
    matrices of a camera have names in capitals, and the same bytes.
    """
    store = Typestore(max_sequence_length=ros2.max_sequence_length)
    store.fielddefs = {name: item for name, item in ros2.fielddefs.items() if name not in OTHERWISE_IN_ROS1}
    store.types = {name: item for name, item in ros2.types.items() if name not in OTHERWISE_IN_ROS1}

    constants, fields = ros2.fielddefs[RANGE]
    store.fielddefs[RANGE] = (constants, [field for field in fields if field[0] != "variance"])
    store.types[RANGE] = cast("type[MsgType]", partial(ros2.types[RANGE], variance=0.0))

    # The four bytes of the sequence number are skipped by shifting all offsets; the buffer begins with zeros.
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


@cache
def _ros_texts() -> dict[str, str]:
    """Return the texts of ROS's own messages in ROS 1, which are the same for every set of types."""
    root = files("cellwright.middleware.messages") / "ros1_texts"
    return {
        f"{package.name}/{MESSAGE}/{file.name.removesuffix('.msg')}": file.read_bytes().decode()
        for package in root.iterdir()
        if package.is_dir()
        for file in package.iterdir()
    }


def _unsupported(name: str) -> UsageError:
    return UsageError(f"{short_name(name)} has different fields in ROS 1 and is not supported there")
