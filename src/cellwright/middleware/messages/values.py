"""Messages as JSON values by field name, for types whose fields differ between ROS 1, ROS 2 and its distributions.

`control_msgs` has other fields in ROS 2: a state has `reference` and `feedback` in place of `desired` and `actual`, a
goal has parts for joints with several degrees of freedom. The bridge fills a message of its own distribution by name:
it ignores what that lacks, and what only that has stays at its default. So do readers here, but in a goal fields that
are unknown here must be empty: to ignore them would change the motion.
"""

import json
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc
from rosbags.typesys.base import normalize_fieldname
from rosbags.typesys.store import Typestore

from cellwright.middleware.messages.message_class import Message, short_name
from cellwright.util.errors import MessageError

M = TypeVar("M", bound=Message)

_RENAMED = {"control_msgs/msg/JointTrajectoryControllerState": {"desired": "reference", "actual": "feedback"}}
"""Fields that have another name in ROS 2, by type."""

_ADDED: Mapping[str, Callable[[dict[str, Any]], dict[str, Any]]] = {
    "control_msgs/srv/QueryTrajectoryState_Response": lambda _values: {"success": True},
    "control_msgs/msg/JointTrajectoryControllerState": lambda values: {
        "output": {"positions": values["reference"]["positions"]},  # that controller commands positions
        "speed_scaling_factor": 1.0,
    },
}
"""Fields that ROS 2 adds, made of the others, by type."""


class ValueForm:
    """JSON form of a set of types.

    Args:
        store: types in their ROS 2 form.
        find: returns the class of a message, by full name.
        check: validates a message, see `TypeSet.checked`.
    """

    def __init__(self, store: Typestore, find: Callable[[str], type[Message]], check: Callable[[Any], Any]) -> None:
        self._definitions = store.fielddefs
        self._find, self._check = find, check

    def write(self, message: Message) -> bytes:
        """Return a message as a JSON object in bytes.

        Raises:
            MessageError: a value does not fit its field.
        """
        return json.dumps(self._value(self._check(message))).encode()

    def read(self, data: bytes | memoryview, message_class: type[M]) -> M:
        """Return the message in a JSON object; fields that it lacks have their defaults.

        Raises:
            MessageError: the bytes are no JSON object, a field does not fit, or of a goal one is not empty that the
                type lacks.
        """
        name = message_class.__msgtype__
        try:
            values = json.loads(bytes(data))
        except (ValueError, RecursionError) as error:
            raise MessageError(f"invalid {short_name(name)} in {len(data)} bytes: {error}") from None
        message: M = self._check(self._built(values, name, "", is_whole=name.endswith("Goal")))
        return message

    def _value(self, value: Any) -> Any:
        if isinstance(value, np.ndarray):
            return value.tolist()
        if isinstance(value, list | tuple):
            return [self._value(each) for each in value]
        name = getattr(value, "__msgtype__", None)
        if name is None:
            return value
        renamed = _RENAMED.get(name, {})
        found: dict[str, Any] = {}
        for field, _ in self._definitions[name][1]:
            found[renamed.get(field, field)] = self._value(getattr(value, normalize_fieldname(field)))
        return {**found, **_ADDED[name](found)} if name in _ADDED else found

    def _built(self, values: Any, name: str, where: str, *, is_whole: bool) -> Any:
        if not isinstance(values, dict):
            raise MessageError(f"{where or short_name(name)} must be an object (got {values!r:.40})")
        renamed = _RENAMED.get(name, {})
        fields = {renamed.get(key, key): (key, desc) for key, desc in self._definitions[name][1]}
        place = f"{where}." if where else ""
        for key, value in values.items():
            if key not in fields and is_whole and not _is_empty(value):
                raise MessageError(f"{place}{key} is not supported here; leave it empty")
        given = {
            normalize_fieldname(own): self._member(values[key], desc, f"{place}{key}", is_whole=is_whole)
            if key in values
            else self._default(desc)
            for key, (own, desc) in fields.items()
        }
        return self._find(name)(**given)

    def _member(self, value: Any, desc: FieldDesc, where: str, *, is_whole: bool) -> Any:
        match desc:
            case (Nodetype.NAME, name):
                return self._built(value, str(name), where, is_whole=is_whole)
            case (Nodetype.SEQUENCE | Nodetype.ARRAY, ((Nodetype.NAME, name), _)) if isinstance(value, list):
                places = ((each, f"{where}[{index}]") for index, each in enumerate(value))
                return [self._built(each, str(name), place, is_whole=is_whole) for each, place in places]
        return value

    def _default(self, desc: FieldDesc) -> Any:
        """Return the value of a field that was not given; the check gives it its form."""
        match desc:
            case (Nodetype.NAME, name):
                return self._built({}, str(name), "", is_whole=False)
            case (Nodetype.SEQUENCE, _):
                return []
            case (Nodetype.ARRAY, (member, length)):
                return [self._default(member)] * int(length)
            case (_, ("string", _)):
                return ""
            case (_, ("bool", _)):
                return False
            case (_, (str(name), _)) if name.startswith("float"):
                return 0.0
        return 0


def _is_empty(value: Any) -> bool:
    """Return whether a value holds nothing: zeros, empty texts and lists, or objects of such."""
    if isinstance(value, dict):
        return all(map(_is_empty, value.values()))
    return not value
