"""Definitions and checksums, as the two ROS generations make them.

The ROS 1 checksum of a message is the MD5 of its bare text: constants first, then fields, comments dropped, and each
type that is itself a message replaced by that one's checksum. A service is the MD5 of its two bare texts joined with
nothing between.
"""

from functools import cache
from hashlib import md5 as hash_md5
from typing import Literal

from rosbags.typesys import TypesysError

from cellwright.middleware.messages.names import full_name, short_name
from cellwright.middleware.messages.types import ServiceType, message_type, ros1_store, ros2_store, service_type
from cellwright.util.errors import UnknownNameError, UsageError

SEPARATOR = "=" * 80


@cache
def md5(name: str) -> str:
    """The ROS 1 checksum of a message or service, by its short or full name; no name stands for both.

    Raises:
        UnknownNameError: there is neither a message nor a service of this name.
        UsageError: the type has another form in ROS 1 that is not supported.
    """
    try:
        return message_md5(message_type(name).__msgtype__)
    except UnknownNameError as no_message:
        try:
            service = service_type(name)
        except (UnknownNameError, UsageError):
            raise no_message from None
        return service_md5(service)


def message_md5(full: str) -> str:
    """The ROS 1 checksum of a message by its full name."""
    return _digest(_bare_text(full))


def service_md5(service: ServiceType) -> str:
    """The ROS 1 checksum of a service."""
    return _digest(_bare_text(service.request.__msgtype__) + _bare_text(service.response.__msgtype__))


def definition(name: str, *, ros: Literal[1, 2] = 1) -> str:
    """The whole definition of a message, the types in it included, as connection headers and bags carry it.

    Raises:
        UnknownNameError: there is no such message.
        UsageError: the type has another form in ROS 1 that is not supported.
    """
    return _definition(message_type(name).__msgtype__, ros)


def type_hash(name: str) -> str:
    """The ROS 2 hash of a message ("RIHS01_…")."""
    return ros2_store().hash_rihs01(message_type(name).__msgtype__)


def _definition(full: str, ros: Literal[1, 2]) -> str:
    store = ros1_store() if ros == 1 else ros2_store()
    try:
        return store.generate_msgdef(full, ros_version=ros)[0]
    except TypesysError:
        raise UsageError(f"{short_name(full)} has another form in ROS 1, which is not supported") from None


def _bare_text(full: str) -> str:
    """The text that goes into the checksum of a message or of one half of a service."""
    lines = []
    for line in _definition(full, 1).split(SEPARATOR)[0].splitlines():
        kind, _, rest = line.partition(" ")
        package_type = kind.partition("[")[0]
        lines.append(f"{message_md5(full_name(package_type))} {rest}" if "/" in package_type else line)
    return "\n".join(lines)


def _digest(text: str) -> str:
    return hash_md5(text.encode(), usedforsecurity=False).hexdigest()
