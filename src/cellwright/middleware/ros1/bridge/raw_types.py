"""Classes that rospy takes for message types, made from a name, a checksum and a definition: they hold bytes."""

from __future__ import annotations

from typing import Any

import genpy

ANY = "*"
"""Checksum and type that stand for whatever the other side has."""


def raw_type(name: str, md5: str = ANY, definition: str = "") -> Any:
    """A message class of rospy's whose messages hold their bytes as `data` and are otherwise opaque."""
    namespace = {
        "__slots__": ["data"],
        "__init__": _hold,
        "serialize": _serialize,
        "deserialize": _deserialize,
        "_type": name,
        "_md5sum": md5,
        "_full_text": definition,
        "_has_header": False,
        "_slot_types": ["uint8[]"],
    }
    return type("Raw", (genpy.Message,), namespace)


def _hold(self: Any, data: bytes = b"") -> None:
    self.data = data


def _serialize(self: Any, buffer: Any) -> None:
    buffer.write(self.data)


def _deserialize(self: Any, data: bytes) -> Any:
    self.data = bytes(data)
    return self
