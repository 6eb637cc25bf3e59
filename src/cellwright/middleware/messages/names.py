"""Names of types. Short is how people write them ("osrf_gear/Order"), full is ROS 2's ("osrf_gear/msg/Order").

Both are understood everywhere; short ones are given back. A service is named alike ("osrf_gear/AGVControl"); its two
halves are types of their own, "osrf_gear/srv/AGVControl_Request" and "…_Response".
"""

from typing import ClassVar, Protocol

from cellwright.util.errors import UsageError

MESSAGE = "msg"
SERVICE = "srv"


class Message(Protocol):
    """What every message class has: its full name."""

    __msgtype__: ClassVar[str]


def full_name(name: str, namespace: str = MESSAGE) -> str:
    """The full name of a type.

    Raises:
        UsageError: the name is neither "package/Name" nor "package/msg/Name" (or srv, as `namespace` says).
    """
    match name.split("/"):
        case [package, last] if package and last:
            return f"{package}/{namespace}/{last}"
        case [package, middle, last] if package and last and middle in (namespace, SERVICE):
            return name
        case _:
            raise UsageError(f"{name!r} is no name of a type: they look like 'osrf_gear/Order'")


def short_name(name: str) -> str:
    """The short name of a type: "osrf_gear/Order"."""
    package, _, rest = name.partition("/")
    return f"{package}/{rest.rpartition('/')[2]}" if rest else package


def type_of(message: Message | type[Message]) -> str:
    """The short name of a message's type."""
    return short_name(message.__msgtype__)
