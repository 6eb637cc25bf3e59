"""Validation of messages from outside: checks each field against its type."""

import dataclasses
from collections.abc import Callable
from functools import cache
from typing import TypeVar

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc
from rosbags.typesys.base import normalize_fieldname
from rosbags.typesys.store import Typestore

from cellwright.middleware.messages.conversions import single
from cellwright.middleware.messages.message_class import Message, short_name
from cellwright.util.errors import MessageError

M = TypeVar("M", bound=Message)

Check = Callable[[object, str], object]
"""Takes a value and its place; returns the value in the right form, or raises a MessageError.

Errors name a message without a place ("") by its type.
"""

_ANY_STRING = (Nodetype.BASE, ("string", 0))

INTEGERS = {
    "byte": (-128, 127),
    "char": (0, 255),
    **{f"int{bits}": (-(1 << bits - 1), (1 << bits - 1) - 1) for bits in (8, 16, 32, 64)},
    **{f"uint{bits}": (0, (1 << bits) - 1) for bits in (8, 16, 32, 64)},
}


class Checks:
    """Checks of all messages of a set of types.

    Args:
        store: types in their ROS 2 form.
        find: returns the class of a message, by full name.
    """

    def __init__(self, store: Typestore, find: Callable[[str], type[Message]]) -> None:
        self._store = store
        self._find = find
        self._check = cache(self._make_check)
        self.has_bounds = cache(self._has_bounds)
        """True if the type of a full name limits strings or sequences, at any depth; decoders do not check that."""

    def checked(self, message: M) -> M:
        """Return the message, or a copy of it with the right forms of its fields; see `TypeSet.checked`."""
        name = getattr(type(message), "__msgtype__", None)  # of the class: an instance's attributes are its fields
        if not isinstance(name, str):
            raise MessageError(f"{describe_value(message)} is not a message")
        return self._check(name)(message, "")  # type: ignore[return-value]

    def _make_check(self, name: str) -> Check:
        message_class = self._find(name)
        fields = self._store.fielddefs[name][1]
        members = [(normalize_fieldname(field), self._field_check(desc)) for field, desc in fields]
        short = short_name(name)

        def check(value: object, where: str) -> object:
            where = where or short
            if not isinstance(value, message_class):
                raise MessageError(f"{where} must be of type {short}, not {describe_value(value)}")
            named = value.__msgtype__
            if named is not name and not (isinstance(named, str) and named == name):
                raise MessageError(f"{where} is of type {short}, but its __msgtype__ is {describe_value(named)}")
            changes = {}
            for member, check_member in members:
                given = getattr(value, member)
                taken = check_member(given, f"{where}.{member}")
                if taken is not given:
                    changes[member] = taken
            return dataclasses.replace(value, **changes) if changes else value  # type: ignore[type-var]

        return check

    def _field_check(self, desc: FieldDesc) -> Check:
        """Return the check for one field."""
        match desc:
            case (Nodetype.BASE, (name, limit)):
                return _base_check(str(name), int(limit))
            case (Nodetype.NAME, name):
                return lambda value, where: self._check(str(name))(value, where)  # built at first use
            case (kind, ((Nodetype.BASE, (name, limit)), length)) if name != "string":
                return _numbers_check(str(name), int(length), fixed=kind == Nodetype.ARRAY)
            case (kind, (member, length)):
                check = _list_check(self._field_check(member), int(length), fixed=kind == Nodetype.ARRAY)
                return _unless_plain(check) if member == _ANY_STRING and not length else check

    def _has_bounds(self, name: str) -> bool:
        return any(self._is_bounded(desc) for _, desc in self._store.fielddefs[name][1])

    def _is_bounded(self, desc: FieldDesc) -> bool:
        match desc:
            case (Nodetype.BASE, (_, limit)):
                return bool(limit)
            case (Nodetype.NAME, name):
                return self.has_bounds(str(name))
            case (kind, (member, length)):
                return (kind == Nodetype.SEQUENCE and bool(length)) or self._is_bounded(member)


def _base_check(name: str, limit: int) -> Check:
    if name == "string":

        def check_string(value: object, where: str) -> object:
            if not isinstance(value, str):
                raise MessageError(f"{where} must be a string, not {describe_value(value)}")
            try:
                value.encode()
            except UnicodeEncodeError:
                raise MessageError(f"{where} cannot be encoded as UTF-8") from None
            if limit and len(value) > limit:
                raise MessageError(f"{where} may have at most {limit} characters, not {len(value)}")
            return value

        return check_string
    if name == "bool":

        def check_bool(value: object, where: str) -> object:
            if isinstance(value, np.bool_):
                return bool(value)
            if not isinstance(value, bool):
                raise MessageError(f"{where} must be true or false, not {describe_value(value)}")
            return value

        return check_bool
    if name in INTEGERS:
        low, high = INTEGERS[name]

        def check_integer(value: object, where: str) -> object:
            if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
                raise MessageError(f"{where} must be a whole number, not {describe_value(value)}")
            if not low <= value <= high:
                raise MessageError(f"{where} must be from {low} to {high}, not {value}")
            return value if type(value) is int else int(value)

        return check_integer

    def check_float(value: object, where: str) -> object:
        if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
            raise MessageError(f"{where} must be a number, not {describe_value(value)}")
        try:
            number = single(float(value)) if name == "float32" else float(value)
        except (OverflowError, MessageError):
            raise MessageError(f"{where} must fit into {name}, not {describe_value(value)}") from None
        return value if isinstance(value, float) and (number == value or number != number) else number

    return check_float


def _numbers_check(name: str, length: int, *, fixed: bool) -> Check:
    """Return the check for a sequence of numbers: an array, or a list that converts to one."""
    dtype = np.dtype({"bool": "bool", "byte": "int8", "char": "uint8"}.get(name, name))
    check_one = _base_check(name, 0)

    def check(value: object, where: str) -> object:
        if isinstance(value, np.ndarray) and value.dtype == dtype and value.ndim == 1:
            _check_length(len(value), length, where, fixed=fixed)
            return value
        if isinstance(value, (bytes, bytearray)) and dtype.itemsize == 1:
            value = np.frombuffer(bytes(value), dtype=dtype)
        elif isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim == 1):
            value = np.array([check_one(item, f"{where}[{i}]") for i, item in enumerate(value)], dtype=dtype)
        else:
            raise MessageError(f"{where} must be a sequence of {name}, not {describe_value(value)}")
        _check_length(len(value), length, where, fixed=fixed)
        value.flags.writeable = False
        return value

    return check


def _list_check(check_one: Check, length: int, *, fixed: bool) -> Check:
    """Return the check for a sequence of strings or messages."""

    def check(value: object, where: str) -> object:
        if not isinstance(value, (list, tuple)):
            raise MessageError(f"{where} must be a list, not {describe_value(value)}")
        _check_length(len(value), length, where, fixed=fixed)
        taken = [check_one(item, f"{where}[{i}]") for i, item in enumerate(value)]
        same = isinstance(value, list) and all(a is b for a, b in zip(taken, value, strict=True))
        return value if same else taken

    return check


def _unless_plain(check: Check) -> Check:
    """Return a check for a list of unbounded strings that runs `check` only if one is not plain ASCII.

    It is for the names in commands, dozens in a message: a check of each string costs six times as much.
    """

    def check_strings(value: object, where: str) -> object:
        if type(value) is list and not set(map(type, value)) - {str} and "".join(value).isascii():
            return value
        return check(value, where)

    return check_strings


def _check_length(count: int, length: int, where: str, *, fixed: bool) -> None:
    if fixed and count != length:
        raise MessageError(f"{where} must have {length} entries, not {count}")
    if length and count > length:
        raise MessageError(f"{where} may have at most {length} entries, not {count}")


def describe_value(value: object) -> str:
    """Return a short text of any value, for an error."""
    if isinstance(value, (str, int, float, bool, type(None))):
        text = repr(value)
    else:
        text = short_name(str(getattr(type(value), "__msgtype__", ""))) or type(value).__name__
    return text if len(text) <= 60 else f"{text[:57]}..."
