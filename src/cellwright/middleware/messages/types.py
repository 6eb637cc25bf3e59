"""Sets of message and service types: classes and definitions by name, encodings and ROS 1 checksums.

A folder of definitions contains text that ROS 1 and ROS 2 both accept, except for `time` and `duration`.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, cached_property
from importlib.resources.abc import Traversable
from typing import Any, NamedTuple, TypeVar

from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import Constdefs, Fielddefs
from rosbags.serde import SerdeError
from rosbags.typesys import get_types_from_msg
from rosbags.typesys.store import Typestore
from rosbags.typesys.stores import ros2_kilted

from cellwright.middleware.messages.cdr import Writer, cdr_writer
from cellwright.middleware.messages.message_class import (
    MESSAGE,
    SERVICE,
    Message,
    MessageClass,
    full_name,
    short_name,
    type_of,
)
from cellwright.middleware.messages.ros1_form import Ros1Form
from cellwright.middleware.messages.validation import Checks
from cellwright.middleware.messages.values import ValueForm
from cellwright.middleware.wire.frames import VALUE_PACKAGES
from cellwright.util.errors import MessageError, UnknownNameError, UsageError

EMPTY_FIELDS: Fielddefs = [("structure_needs_at_least_one_member", (Nodetype.BASE, ("uint8", 0)))]
"""Fields of an empty message in ROS 2; ROS 1 sends nothing."""
MAX_SEQUENCE = 1 << 24
"""Most entries of a field that are decoded: no cell sends more, and the limit bounds memory if a length is wrong."""
MAX_TRAILING = 8
"""Bytes behind a message in which rclpy pads it (measured in Jazzy); the library tolerates three on its own."""
FAULTS = (SerdeError, struct.error, ValueError, TypeError, AttributeError, IndexError, AssertionError, OverflowError)
"""Errors of the library for values that do not fit their fields."""

M = TypeVar("M", bound=Message)


@dataclass(frozen=True, slots=True)
class ServiceType:
    """Type of a service: its short name, and the classes of its two halves."""

    name: str
    request: type[Message]
    response: type[Message]


class Encoding(NamedTuple):
    """Encoding of messages: functions that write and read bytes."""

    write: Callable[[Message], bytes]
    read: Callable[[bytes, type[Message]], Message]


class TypeSet:
    """Set of types: the standard ones of ROS 2, and those of a folder of definitions.

    A bus, a client and a recording each have one: types of one name in two sets are strangers, with fields of their
    own. Methods accept short names ("osrf_gear/Order") and full ones ("osrf_gear/msg/Order").

    Args:
        definitions: folder of `PACKAGE/msg/NAME.msg` and `PACKAGE/srv/NAME.srv`.
        modules: modules with the message classes of these definitions.

    Example:
        >>> from cellwright.middleware.messages import TYPES
        >>> order = TYPES.message("osrf_gear/Order")(order_id="order_0")
        >>> TYPES.from_cdr(TYPES.to_cdr(order), type(order)) == order
        True
    """

    def __init__(self, definitions: Traversable, modules: Iterable[object]) -> None:
        self._folder = definitions
        items = (item for module in modules for item in vars(module).values() if isinstance(item, type))
        classes = (item for item in items if issubclass(item, MessageClass) and item is not MessageClass)
        self.own: Mapping[str, type[Message]] = {item.__msgtype__: item for item in classes}
        """Classes of the definitions, by full name."""
        self.encodings: Mapping[str, Encoding] = {
            "cdr": Encoding(self.to_cdr, self.from_cdr),
            "ros1": Encoding(self.to_ros1, self.from_ros1),
            "ros2": Encoding(self.to_ros2, self.from_ros2),
        }
        """Wire encodings by name: CDR as in ROS 2, the form of ROS 1, and that of the bridge to ROS 2."""
        # What a name leads to never changes in a set, and is asked for with nearly every message.
        self._message = cache(self._find_message)
        self._service = cache(self._find_service)
        self._writer = cache(self._make_writer)
        self._md5 = cache(self._find_md5)
        self._definition = cache(self._find_definition)
        self.has_bounds: Callable[[str], bool] = cache(lambda name: self._checks.has_bounds(name))
        """True if the type of a full name limits strings or sequences, at any depth; decoders do not check that."""

    @cached_property
    def sources(self) -> Mapping[str, str]:
        """Text of every definition file by full name ("osrf_gear/msg/Order", "std_srvs/srv/Trigger"), sorted."""
        found = {}
        for package in self._folder.iterdir():
            for namespace in package.iterdir():
                for file in namespace.iterdir():
                    stem, _, ending = file.name.rpartition(".")
                    if ending == namespace.name:
                        found[f"{package.name}/{namespace.name}/{stem}"] = file.read_text(encoding="utf-8")
        return dict(sorted(found.items()))

    def parsed(self) -> Iterator[tuple[str, tuple[Constdefs, Fielddefs]]]:
        """Yield every type of the definition files, with its constants and fields; a service has two types."""
        for name, text in self.sources.items():
            package, namespace, last = name.split("/")
            if namespace == MESSAGE:
                yield name, _parse_definition(text, package, last)
            else:
                request, _, response = text.partition("---\n")
                yield f"{name}_Request", _parse_definition(request, package, last)
                yield f"{name}_Response", _parse_definition(response, package, last)

    @cached_property
    def ros2(self) -> Typestore:
        """The library's store of ROS 2 types, with those of the definitions. It is built at first use (some 20 ms)."""
        store = Typestore(ros2_kilted, max_sequence_length=MAX_SEQUENCE)
        for name, definition in self.parsed():
            store.fielddefs[name] = definition
            store.types[name] = self.own[name]
        return store

    @cached_property
    def ros1(self) -> Ros1Form:
        """The same types in ROS 1."""
        return Ros1Form(self.ros2, self.sources)

    def message(self, name: str) -> type[Message]:
        """Return the class of a message.

        Raises:
            UnknownNameError: there is no such message; the error lists those of its package.
            UsageError: the name is not of the form of a type name.
        """
        return self._message(name)

    def service(self, name: str) -> ServiceType:
        """Return the classes of a service.

        Raises:
            UnknownNameError: there is no such service; the error lists those of its package.
            UsageError: the name is not of the form of a type name.
        """
        return self._service(name)

    def md5(self, name: str) -> str:
        """Return the ROS 1 checksum of a message or service; no name stands for both.

        Raises:
            UnknownNameError: there is neither a message nor a service of this name.
            UsageError: the type has another form in ROS 1 that is not supported.
        """
        return self._md5(name)

    def definition(self, name: str) -> str:
        """Return the full ROS 1 definition of a message, with the types in it, as in connection headers and bags.

        It is that of ROS 1 itself, with comments: `rosbag check` compares the texts. Types that Cellwright has no text
        of have one without comments.

        Raises:
            UnknownNameError: there is no such message.
            UsageError: the type has another form in ROS 1 that is not supported.
        """
        return self._definition(name)

    def checked(self, message: M) -> M:
        """Return the message itself, if every field fits its type.

        Lists and tuples of numbers become arrays, and single-precision numbers are rounded; then the result is a copy
        with these fields replaced.

        Raises:
            MessageError: a field does not fit, with its place (`points[2].positions`); or it is no message at all.
        """
        return self._checks.checked(message)

    def to_cdr(self, message: Message) -> bytes:
        """Return a message as little-endian CDR with its four-byte head.

        Raises:
            MessageError: a value does not fit its field.
        """
        try:
            return self._writer(message.__msgtype__)(message)
        except FAULTS as fault:
            raise self._unwritable(message, fault) from fault

    def from_cdr(self, data: bytes | memoryview, message_class: type[M]) -> M:
        """Return the message in CDR bytes of either endianness.

        Raises:
            MessageError: the bytes are no message of this class.
        """
        return _decode(self.ros2.deserialize_cdr, data, message_class)

    def cdr_writer(self, name: str) -> Writer:
        """Return the writer of a full name's type: it does not validate, and raises `FAULTS` for unfit values."""
        return self._writer(name)

    def to_ros1(self, message: Message) -> bytes:
        """Return a message as bytes of its ROS 1 form.

        Raises:
            MessageError: a value does not fit its field.
            UsageError: the type has another form in ROS 1 that is not supported.
        """
        name = message.__msgtype__
        self.ros1.require(name)
        try:
            return bytes(self.ros1.store.serialize_ros1(message, name))
        except FAULTS as fault:
            raise self._unwritable(message, fault) from fault

    def from_ros1(self, data: bytes | memoryview, message_class: type[M]) -> M:
        """Return the message in bytes of the ROS 1 form.

        Raises:
            MessageError: the bytes are no message of this class.
            UsageError: the type has another form in ROS 1 that is not supported.
        """
        self.ros1.require(message_class.__msgtype__)
        return _decode(self.ros1.store.deserialize_ros1, data, message_class)

    def to_ros2(self, message: Message) -> bytes:
        """Return a message for the bridge to ROS 2: as CDR, or as JSON values if it is of one of `VALUE_PACKAGES`.

        Raises:
            MessageError: a value does not fit its field.
        """
        return (self._values.write if _is_values(message) else self.to_cdr)(message)

    def from_ros2(self, data: bytes | memoryview, message_class: type[M]) -> M:
        """Return the message in bytes of the bridge to ROS 2, which may end with `MAX_TRAILING` bytes of no meaning.

        Raises:
            MessageError: the bytes are no message of this class.
        """
        if _is_values(message_class):
            return self._values.read(data, message_class)
        # The padding has no length of its own: the shortest one with which the message fits is taken.
        try:
            return self.from_cdr(data, message_class)
        except MessageError:
            for extra in range(4, MAX_TRAILING + 1, 4):
                with suppress(MessageError):
                    return self.from_cdr(data[:-extra], message_class)
            raise

    @cached_property
    def _checks(self) -> Checks:
        return Checks(self.ros2, self.message)

    @cached_property
    def _values(self) -> ValueForm:
        return ValueForm(self.ros2, self.message, self.checked)

    def _make_writer(self, name: str) -> Writer:
        return cdr_writer(name, self.ros2.fielddefs)

    def _find_message(self, name: str) -> type[Message]:
        full = full_name(name)
        found: type[Message] | None = self.own.get(full)
        if found is None and full in ros2_kilted.FIELDDEFS:
            found = getattr(ros2_kilted, full.replace("/", "__"))
        if found is None:
            raise _unknown_type("message", name, [*self.own, *ros2_kilted.FIELDDEFS], MESSAGE)
        return found

    def _find_service(self, name: str) -> ServiceType:
        full = full_name(name, SERVICE)
        try:
            return ServiceType(short_name(full), self.own[f"{full}_Request"], self.own[f"{full}_Response"])
        except KeyError:
            names = [key.removesuffix("_Request") for key in self.own if key.endswith("_Request")]
            raise _unknown_type("service type", name, names, SERVICE) from None

    def _find_md5(self, name: str) -> str:
        try:
            return self.ros1.message_md5(self.message(name).__msgtype__)
        except UnknownNameError as no_message:
            try:
                service = self.service(name)
            except (UnknownNameError, UsageError):
                raise no_message from None
            return self.ros1.service_md5(service.request.__msgtype__, service.response.__msgtype__)

    def _find_definition(self, name: str) -> str:
        return self.ros1.definition(self.message(name).__msgtype__)

    def _unwritable(self, message: Message, fault: Exception) -> MessageError:
        """Return the error for a message that cannot be written; it names the field if possible."""
        try:
            self.checked(message)
        except MessageError as error:
            return error
        return MessageError(f"cannot encode {type_of(message)}: {fault}")


def _parse_definition(text: str, package: str, last: str) -> tuple[Constdefs, Fielddefs]:
    name = f"{package}/msg/{last}"  # looks bare type names up in its own package
    constants, fields = get_types_from_msg(text, name)[name]
    return constants, fields or EMPTY_FIELDS


def _unknown_type(kind: str, name: str, known: list[str], namespace: str) -> UnknownNameError:
    """Return the error for an unknown type; it lists the names of its package, or the packages if that is unknown."""
    package = name.partition("/")[0]
    same = sorted({short_name(key) for key in known if key.startswith(f"{package}/{namespace}/")})
    if same:
        return UnknownNameError(kind, name, same)
    return UnknownNameError(f"{kind} package", package, sorted({key.partition("/")[0] for key in known}))


def _is_values(message: Message | type[Message]) -> bool:
    return message.__msgtype__.partition("/")[0] in VALUE_PACKAGES


def _decode(read: Callable[[Any, str], object], data: bytes | memoryview, message_class: type[M]) -> M:
    """Return the message that the library reads in bytes."""
    name = message_class.__msgtype__
    try:
        message = read(data, name)
    except (*FAULTS, MemoryError) as fault:
        raise MessageError(f"invalid {short_name(name)} in {len(data)} bytes: {fault}") from fault
    if not isinstance(message, message_class):
        raise UsageError(f"{message_class!r} is not the class of {name}")
    return message
