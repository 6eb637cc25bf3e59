"""Forms of JSON values, such as a result's or a plan's: what belongs where, checked in one pass.

A form is a type, `Maybe` one, a list with the form of its items, a mapping or `Each`. A mapping holds the forms of the
required entries, `Each` the form of all values.
"""

import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

_NAMES = {str: "a string", bool: "true or false", int: "a whole number", float: "a finite number"}


@dataclass(frozen=True, slots=True)
class Maybe:
    """Form of an optional value: None, an empty mapping, or a value of `form`."""

    form: Any


@dataclass(frozen=True, slots=True)
class Each:
    """Form of a mapping whose values all have one form."""

    form: Any


def find_misfit(value: object, form: Any, key: str = "") -> str:
    """Return the first place where a JSON value does not fit the form, and what belongs there; empty if it fits."""
    match form:
        case Maybe():
            return "" if value in (None, {}) else find_misfit(value, form.form, key)
        case Each():
            if not isinstance(value, Mapping):
                return f"{key} must be an object"
            return _first(find_misfit(each, form.form, f"{key}.{name}") for name, each in value.items())
        case [item]:
            if not isinstance(value, list):
                return f"{key} must be a list"
            return _first(find_misfit(each, item, f"{key}[{number}]") for number, each in enumerate(value))
        case Mapping():
            if not isinstance(value, Mapping):
                return f"{key} must be an object"
            prefix = f"{key}." if key else ""
            if missing := [name for name in form if name not in value]:
                return f"{prefix}{missing[0]} is missing"
            return _first(find_misfit(value[name], inner, f"{prefix}{name}") for name, inner in form.items())
        case _:
            return "" if _is_of(value, form) else f"{key} must be {_NAMES[form]}"


def _is_of(value: object, kind: type) -> bool:
    if kind is float:
        return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max
    return isinstance(value, kind) and (kind is not int or not isinstance(value, bool))


def _first(misfits: Iterable[str]) -> str:
    return next(filter(None, misfits), "")
