"""Layout of a cell as plain data: mappings, lists, texts, numbers and None, as JSON has them.

The data follow the fields of the dataclasses of `layout`, by name. Poses have `position` and `quaternion` (w, x, y, z).
"""

from __future__ import annotations

import math
import types
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any, Literal, TypeAlias, Union, cast, get_args, get_origin, get_type_hints

from cellwright.config.layout.layout import Layout
from cellwright.util.errors import UsageError

Data: TypeAlias = Any
"""None, a bool, a number, a text, a list of such data, or a mapping from texts to such data."""

_INFINITE = {"inf": math.inf, "-inf": -math.inf}


def layout_data(layout: Layout) -> dict[str, Data]:
    """Return a layout as plain data, which `json.dumps` takes.

    Example:
        >>> from cellwright.config.layout.gear2017 import gear2017
        >>> layout_data(gear2017())["bins"][6]["pose"]["position"]
        [-0.3, 0.23, 0.0]
    """
    return cast("dict[str, Data]", plain(layout))


def layout_from_data(data: Data) -> Layout:
    """Return the layout of data as `layout_data` returns them; the two are equal.

    Raises:
        UsageError: an entry is missing, unknown or of another kind.
    """
    return cast("Layout", value_of(Layout, data, "layout"))


def plain(value: Any) -> Data:
    """Return a dataclass, mapping or sequence as plain data; infinite numbers as texts, since JSON has none."""
    if is_dataclass(value):
        return {each.name: plain(getattr(value, each.name)) for each in fields(value) if each.init}
    if isinstance(value, Mapping):
        return {name: plain(each) for name, each in value.items()}
    if isinstance(value, tuple | list):
        return [plain(each) for each in value]
    return str(value) if value in _INFINITE.values() else value


def value_of(kind: Any, data: Data, place: str) -> Any:
    """Return the value of a type that plain data stand for; `place` names it in errors.

    Raises:
        UsageError: an entry is missing, unknown or of another kind.
    """
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Union or origin is types.UnionType:
        return _first_that_fits(parts, data, place)
    if origin is Literal:
        return data if data in parts else _refuse(place, f"must be one of {', '.join(map(repr, parts))}", data)
    if origin is tuple:
        return _tuple(parts, data, place)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        _check(dict, data, place)
        return {name: value_of(parts[1], each, f"{place}.{name}") for name, each in data.items()}
    if is_dataclass(kind):
        return _dataclass(cast("type[Any]", kind), data, place)
    return _check(kind, data, place)


def _first_that_fits(kinds: Sequence[Any], data: Data, place: str) -> Any:
    if data is None and type(None) in kinds:
        return None
    errors: list[UsageError] = []
    for kind in kinds:
        if kind is not type(None):
            try:
                return value_of(kind, data, place)
            except UsageError as error:
                errors.append(error)
    raise errors[-1]


def _tuple(kinds: Sequence[Any], data: Data, place: str) -> tuple[Any, ...]:
    _check(list, data, place)
    if kinds[-1:] == (...,):
        kinds = (kinds[0],) * len(data)
    if len(kinds) != len(data):
        _refuse(place, f"must have {len(kinds)} entries", data)
    return tuple(value_of(kind, each, f"{place}[{n}]") for n, (kind, each) in enumerate(zip(kinds, data, strict=True)))


def _dataclass(kind: type[Any], data: Data, place: str) -> Any:
    _check(dict, data, place)
    hints, names = get_type_hints(kind), [each.name for each in fields(kind) if each.init]
    missing, unknown = [each for each in names if each not in data], [each for each in data if each not in names]
    if missing or unknown:
        wrong = [f"lacks {each}" for each in missing] + [f"has an unknown entry {each}" for each in unknown]
        raise UsageError(f"{place}: {', '.join(wrong)}; ask a cell of the same version of Cellwright")
    return kind(**{name: value_of(hints[name], data[name], f"{place}.{name}") for name in names})


def _check(kind: Any, data: Data, place: str) -> Data:
    """Return data that are of a plain type; whole numbers are real ones too."""
    if kind is float and isinstance(data, str) and data in _INFINITE:
        return _INFINITE[data]
    allowed = (int, float) if kind is float else kind
    is_bool = isinstance(data, bool) and kind is not bool
    return data if isinstance(data, allowed) and not is_bool else _refuse(place, f"must be a {kind.__name__}", data)


def _refuse(place: str, problem: str, data: Data) -> Any:
    raise UsageError(f"{place}: {problem} (got {data!r})")
