"""Templates of encoded messages: what stays is encoded once, and times and numbers are filled in again."""

import struct
from collections.abc import Callable, Collection, Hashable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc
from rosbags.typesys.base import normalize_fieldname

from cellwright.middleware.messages.cdr import HEAD, LITTLE_ENDIAN, Definitions, number_format, number_size
from cellwright.middleware.messages.message_class import Message
from cellwright.middleware.messages.types import TypeSet

_ALIGNMENT = 8  # bytes; offsets in a message count from the end of its head, which must be aligned in memory
_SECOND = 1_000_000_000  # [ns]
_TIME = "builtin_interfaces/msg/Time"
_MAX_TEMPLATES = 256  # what a camera sees has as many shapes as a run brings about
_pack_stamp = struct.Struct("<IiI").pack


def stamp_cdr(time: int) -> bytes:
    """Return the CDR of a message that is one stamp, such as `Clock`, at a time [ns]; each tick needs one."""
    return _pack_stamp(LITTLE_ENDIAN, *divmod(time, _SECOND))


class CdrTemplates:
    """Templates of a topic, one for each shape that its messages have.

    Args:
        types: the set of its type.
        fields: as in `CdrTemplate`.

    Example:
        >>> from cellwright.middleware.messages import TYPES
        >>> from cellwright.middleware.messages.conversions import joint_state
        >>> templates = CdrTemplates(TYPES, ("position",))
        >>> message = joint_state(["lift"], [1.5], time=5)
        >>> templates.filled(None, lambda: message, 5, [1.5]) == TYPES.to_cdr(message)
        True
    """

    def __init__(self, types: TypeSet, fields: Collection[str] = ()) -> None:
        self._types, self._fields = types, fields
        self._templates: dict[Hashable, CdrTemplate] = {}

    def filled(self, shape: Hashable, build: Callable[[], Message], time: int, numbers: ArrayLike) -> bytes:
        """Return a message as CDR.

        Args:
            shape: all that determines the message, but for stamps and changing numbers.
            build: returns the message itself, the first time that it has this shape.
            time: time of all its stamps [ns].
            numbers: values of all changing numbers, in the order of the message.
        """
        template = self._templates.get(shape)
        if template is None:
            if len(self._templates) >= _MAX_TEMPLATES:
                self._templates.clear()
            template = self._templates[shape] = CdrTemplate(build(), self._types, self._fields)
        return template.filled(time, numbers)


class CdrTemplate:
    """CDR of a message whose stamps and numbers change, while its strings, lengths and other fields stay.

    It costs a tenth of a message with its objects, and the bytes are those of `TypeSet.to_cdr`.

    Args:
        message: an example.
        types: the set of its type.
        fields: names of the fields with the numbers that change, in messages of any depth. All have one type.

    Example:
        >>> from cellwright.middleware.messages import TYPES
        >>> from cellwright.middleware.messages.conversions import joint_state
        >>> template = CdrTemplate(joint_state(["lift"], [0.0]), TYPES, ("position",))
        >>> template.filled(5, [1.5]) == TYPES.to_cdr(joint_state(["lift"], [1.5], time=5))
        True
    """

    def __init__(self, message: Message, types: TypeSet, fields: Collection[str] = ()) -> None:
        data = types.to_cdr(message)
        walk = _Walk(types.ros2.fielddefs, fields)
        walk.message(message.__msgtype__, message)
        body = len(data) - HEAD
        memory = np.zeros(_ALIGNMENT + body + -body % _ALIGNMENT, np.uint8)
        self._bytes = memory[_ALIGNMENT - HEAD : _ALIGNMENT + body]
        self._bytes[:] = np.frombuffer(data, np.uint8)
        aligned = memory[_ALIGNMENT:]
        self._words = aligned.view("<i4")
        self._stamps = np.array(walk.stamps, np.intp).reshape(-1, 1) // 4 + np.arange(2)
        self._numbers = aligned.view(walk.format)
        self._places = np.array(walk.numbers, np.intp) // self._numbers.itemsize

    def filled(self, time: int, numbers: ArrayLike = ()) -> bytes:
        """Return the message with all its stamps at a time.

        Args:
            time: [ns]
            numbers: values of all changing numbers, in the order of the message.
        """
        self._words[self._stamps] = divmod(time, _SECOND)
        if self._places.size:
            self._numbers[self._places] = numbers
        return self._bytes.tobytes()


class _Walk:
    """Walk through a message, which finds the offsets of its stamps and changing numbers [bytes]."""

    def __init__(self, definitions: Definitions, fields: Collection[str]) -> None:
        self._definitions, self._fields = definitions, fields
        self._at = 0
        self.stamps: list[int] = []
        self.numbers: list[int] = []
        self.format = "<u1"

    def message(self, name: str, message: Any) -> None:
        """Walk through the fields of a message."""
        if name == _TIME:
            self._align(4)
            self.stamps.append(self._at)
        for field, desc in self._definitions[name][1]:
            self._value(desc, getattr(message, normalize_fieldname(field)), changes=field in self._fields)

    def _value(self, desc: FieldDesc, value: Any, *, changes: bool) -> None:
        match desc:
            case (Nodetype.BASE, ("string", _)):
                self._align(4)
                self._at += 4 + len(value.encode()) + 1
            case (Nodetype.BASE, (name, _)):
                size = number_size(str(name))
                self._align(size)
                if changes:
                    self.numbers.append(self._at)
                    self.format = number_format(str(name))
                self._at += size
            case (Nodetype.NAME, name):
                self.message(str(name), value)
            case (kind, (member, _)):
                if kind == Nodetype.SEQUENCE:
                    self._align(4)
                    self._at += 4
                for each in value:
                    self._value(member, each, changes=changes)

    def _align(self, size: int) -> None:
        self._at += -self._at % size
