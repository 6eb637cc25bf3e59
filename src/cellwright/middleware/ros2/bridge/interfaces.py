"""Message, service and action classes by name, and their fields as JSON values."""

from __future__ import annotations

import array
from collections.abc import Sequence
from importlib import import_module
from typing import Any

from rosidl_parser.definition import AbstractNestedType, NamespacedType

from cellwright.middleware.wire.event_loop import MissingError
from cellwright.middleware.wire.frames import VALUE_PACKAGES

HOW_TO_GET_IT = "run scripts/install-ros2, or build the packages of `cellwright ros2-workspace`, and source them"


def interface_class(name: str, kind: str) -> Any:
    """Return the class of "package/Name", where `kind` is `msg`, `srv` or `action`.

    Raises:
        MissingError: this Python has no such interface.
    """
    package, _, last = name.partition("/")
    try:
        return getattr(import_module(f"{package}.{kind}"), last)
    except (ImportError, AttributeError) as error:
        raise MissingError(f"ROS 2 has no {package}/{kind}/{last}: {error}; {HOW_TO_GET_IT}") from None


def is_of_actionlib(type_name: str) -> bool:
    """Return whether a message belongs to an action of ROS 1; in ROS 2 actions have messages of their own."""
    return type_name.startswith("actionlib_msgs/") or type_name.endswith(
        ("ActionGoal", "ActionResult", "ActionFeedback")
    )


def is_values(type_name: str) -> bool:
    """Return whether messages of a type pass as JSON values: their fields are not those of the cell's definition."""
    return type_name.partition("/")[0] in VALUE_PACKAGES


def values_of(message: Any) -> Any:
    """Return a message as JSON values: a dictionary of its fields."""
    if hasattr(message, "get_fields_and_field_types"):
        return {name: values_of(getattr(message, name)) for name in message.get_fields_and_field_types()}
    if isinstance(message, (bytes, bytearray)):
        return list(message)
    if isinstance(message, (str, bool, int, float)):
        return message
    if isinstance(message, (array.array, Sequence)) or hasattr(message, "tolist"):
        return [values_of(each) for each in message]
    return message


def fill(message: Any, values: dict[str, Any]) -> Any:
    """Set the fields of a message that `values` names, and return it; names of other fields are ignored."""
    for (name, _), kind in zip(message.get_fields_and_field_types().items(), message.SLOT_TYPES, strict=True):
        if name not in values:
            continue
        value = values[name]
        if isinstance(kind, NamespacedType):
            fill(getattr(message, name), value)
        elif isinstance(kind, AbstractNestedType) and isinstance(kind.value_type, NamespacedType):
            member = interface_class(f"{kind.value_type.namespaces[0]}/{kind.value_type.name}", "msg")
            setattr(message, name, [fill(member(), each) for each in value])
        else:
            setattr(message, name, value)
    return message
