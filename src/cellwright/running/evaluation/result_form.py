"""The form that results have on disk: what a report reads of one is there, and of the right kind.

A form is a type, `Maybe` one, a list with the form of its items, a mapping with the forms of the entries that it has to
have, or `Each` with the form of all values of a mapping.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Maybe:
    """Either nothing, which is None or an empty mapping, or of a form."""

    form: Any


@dataclass(frozen=True, slots=True)
class Each:
    """A mapping whose values all have a form."""

    form: Any


_PART = {
    "type": str,
    "sentence": str,
    **dict.fromkeys(("presence", "pose", "reachable_presence", "reachable_pose"), float),
}
_KIT = {
    "kit_type": str,
    "submitted": bool,
    "bonus_reason": str,
    **dict.fromkeys(("total", "reachable", "best", "part_presence", "all_parts_bonus", "part_pose"), float),
    "parts": [_PART],
    "extras": [{"name": str, "reason": str}],
}
_SPAN = {"begin": float, "end": Maybe(float)}
_TIMELINE = {
    "end": float,
    "orders": [{"order": str, "announced": float, "completed": Maybe(float)}],
    "kits": [{"time": float, "agv": str, "kit": str, "points": float}],
    "held": [{**_SPAN, "part": str}],
    "agvs": Each([{**_SPAN, "state": str}]),
}
RESULT: Mapping[str, Any] = {
    **dict.fromkeys(("key", "trial", "agent", "outcome", "reason", "state_hash", "command"), str),
    **dict.fromkeys(("points", "reachable", "best", "wall", "simulated"), float),
    "seed": int,
    "vary": bool,
    "limits": Each(float),
    "score": Maybe({"orders": [{"order_id": str, "kits": [_KIT]}]}),
    "timeline": Maybe(_TIMELINE),
    "log": [str],
}
"""The form of a result."""


def find_misfit(value: object, form: Any, key: str = "") -> str:
    """The first place where a JSON value has not the form, and what should be there; empty where it fits."""
    match form:
        case Maybe():
            return "" if value in (None, {}) else find_misfit(value, form.form, key)
        case Each():
            if not isinstance(value, Mapping):
                return f"{key} should be an object"
            return _first(find_misfit(each, form.form, f"{key}.{name}") for name, each in value.items())
        case [item]:
            if not isinstance(value, list):
                return f"{key} should be a list"
            return _first(find_misfit(each, item, f"{key}[{number}]") for number, each in enumerate(value))
        case Mapping():
            if not isinstance(value, Mapping):
                return f"{key} should be an object"
            way = f"{key}." if key else ""
            if missing := [name for name in form if name not in value]:
                return f"{way}{missing[0]} is missing"
            return _first(find_misfit(value[name], inner, f"{way}{name}") for name, inner in form.items())
        case _:
            return "" if _is_of(value, form) else f"{key} should be {_NAMES[form]}"


_NAMES = {str: "a text", bool: "true or false", int: "a whole number", float: "a finite number"}


def _is_of(value: object, kind: type) -> bool:
    if kind is float:
        return isinstance(value, int | float) and not isinstance(value, bool) and _is_finite(value)
    return isinstance(value, kind) and (kind is not int or not isinstance(value, bool))


def _is_finite(number: float) -> bool:
    try:
        return math.isfinite(number)
    except OverflowError:  # a whole number that no float can hold
        return False


def _first(misfits: Iterable[str]) -> str:
    return next(filter(None, misfits), "")
