"""Classes of messages and names of their types.

A type has a short name ("osrf_gear/Order") and a full one ("osrf_gear/msg/Order"). The two halves of a service are
separate types, "osrf_gear/srv/AGVControl_Request" and "…_Response".
"""

import dataclasses
from collections.abc import Callable
from typing import Any, ClassVar, Protocol, TypeVar, dataclass_transform

from cellwright.util.errors import UsageError

MESSAGE = "msg"
SERVICE = "srv"

C = TypeVar("C", bound="MessageClass")


class Message(Protocol):
    """Protocol of message classes: they have a full name."""

    __msgtype__: ClassVar[str]


class MessageClass:
    """Base class of the messages, requests and responses that Cellwright defines."""

    __slots__ = ()
    __msgtype__: ClassVar[str]
    __dataclass_fields__: ClassVar[dict[str, dataclasses.Field[Any]]]


@dataclass_transform(field_specifiers=(dataclasses.field,))
def message_class(name: str) -> Callable[[type[C]], type[C]]:
    """Turn a class into the dataclass of a type with a full name ("osrf_gear/msg/Order")."""

    def decorate(cls: type[C]) -> type[C]:
        cls.__msgtype__ = name
        return dataclasses.dataclass(slots=True)(cls)

    return decorate


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
