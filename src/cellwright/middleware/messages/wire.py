"""Messages as bytes: CDR for ROS 2, and the ROS 1 form."""

from __future__ import annotations

import struct
from typing import TypeVar

from rosbags.serde import SerdeError
from rosbags.typesys import TypesysError

from cellwright.middleware.messages.cdr import writer
from cellwright.middleware.messages.check import checked
from cellwright.middleware.messages.names import Message, short_name, type_of
from cellwright.middleware.messages.types import ros1_store, ros2_store
from cellwright.util.errors import MessageError, UsageError

M = TypeVar("M", bound=Message)

FAULTS = (SerdeError, struct.error, ValueError, TypeError, AttributeError, IndexError, AssertionError, OverflowError)
"""What the library raises over values that do not fit their fields."""


def to_cdr(message: Message) -> bytes:
    """A message as little-endian CDR with its four-byte head.

    Raises:
        MessageError: a value does not fit its field.
    """
    try:
        return writer(message.__msgtype__)(message)
    except FAULTS as fault:
        raise _unwritable(message, fault) from fault


def from_cdr(data: bytes | memoryview, message_class: type[M]) -> M:
    """The message in CDR bytes of either endianness.

    Raises:
        MessageError: the bytes are no message of this class.
    """
    name = message_class.__msgtype__
    try:
        message = ros2_store().deserialize_cdr(data, name)
    except (*FAULTS, MemoryError) as fault:
        raise MessageError(f"these {len(data)} bytes are no {short_name(name)}: {fault}") from fault
    return _typed(message, message_class)


def to_ros1(message: Message) -> bytes:
    """A message in its ROS 1 form.

    Raises:
        MessageError: a value does not fit its field.
        UsageError: the type has another form in ROS 1 that is not supported.
    """
    name = message.__msgtype__
    _require_ros1(name)
    try:
        return bytes(ros1_store().serialize_ros1(message, name))
    except FAULTS as fault:
        raise _unwritable(message, fault) from fault


def from_ros1(data: bytes | memoryview, message_class: type[M]) -> M:
    """The message in bytes of the ROS 1 form.

    Raises:
        MessageError: the bytes are no message of this class.
        UsageError: the type has another form in ROS 1 that is not supported.
    """
    name = message_class.__msgtype__
    _require_ros1(name)
    try:
        message = ros1_store().deserialize_ros1(data, name)
    except (*FAULTS, MemoryError) as fault:
        raise MessageError(f"these {len(data)} bytes are no {short_name(name)}: {fault}") from fault
    return _typed(message, message_class)


def _typed(message: object, message_class: type[M]) -> M:
    if not isinstance(message, message_class):
        raise UsageError(f"{message_class!r} is not the class that {message_class.__msgtype__} is known by")
    return message


def _unwritable(message: Message, fault: Exception) -> MessageError:
    """The error for a message that could not be written: it names the field where that can be found out."""
    try:
        checked(message)
    except MessageError as error:
        return error
    return MessageError(f"this {type_of(message)} cannot be written: {fault}")


def _require_ros1(name: str) -> None:
    try:
        ros1_store().get_msgdef(name)
    except (KeyError, TypesysError):
        raise UsageError(f"{short_name(name)} has another form in ROS 1, which is not supported") from None
