"""Hypothesis strategies for messages of any type, from the definitions, and a comparison that supports arrays."""

import dataclasses
from functools import cache
from typing import Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as st_numpy
from hypothesis.strategies import SearchStrategy
from rosbags.interfaces import Nodetype

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.validation import INTEGERS


@cache
def messages(name: str) -> SearchStrategy[Any]:
    """Generate messages of one type, by full name."""
    store = TYPES.ros2
    fields = [_values(desc) for field, desc in store.fielddefs[name][1] if not field.startswith("structure_needs")]
    return st.builds(store.types[name], *fields)


def _values(desc: Any) -> SearchStrategy[Any]:
    kind, content = desc
    if kind == Nodetype.NAME:
        return messages(content)
    if kind == Nodetype.BASE:
        return _scalars(content[0])
    member, length = content
    sizes = {"min_size": length, "max_size": length} if kind == Nodetype.ARRAY else {"max_size": 3}
    if member[0] == Nodetype.BASE and member[1][0] != "string":
        dtype = np.dtype({"byte": "int8", "char": "uint8"}.get(member[1][0], member[1][0]))
        return st_numpy.arrays(dtype, st.integers(sizes.get("min_size", 0), sizes["max_size"]))
    return st.lists(_values(member), **sizes)


def _scalars(name: str) -> SearchStrategy[Any]:
    if name == "string":
        return st.text(max_size=5)
    if name == "bool":
        return st.booleans()
    if name in INTEGERS:
        return st.integers(*INTEGERS[name])
    return st.floats(width=32 if name == "float32" else 64)


def same(a: Any, b: Any) -> bool:
    """Return whether two messages are the same: classes, arrays bit for bit, and NaN equal to itself."""
    if dataclasses.is_dataclass(a):
        return type(a) is type(b) and all(
            same(getattr(a, field.name), getattr(b, field.name)) for field in dataclasses.fields(a)
        )
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")
    if isinstance(a, list):
        return len(a) == len(b) and all(map(same, a, b))
    return bool(a == b or (a != a and b != b))


JUNK = st.sampled_from(
    [
        None,
        True,
        -1,
        1 << 70,
        10**400,
        float("nan"),
        float("-inf"),
        "",
        "x" * 10_000,
        "\ud800",
        "\0\x1b[2J\n",
        b"\xff",
        (),
        [],
        {},
        [None],
        [[1.0]],
        ["1.0"],
        object(),
        dict,
        np.zeros((2, 2)),
        np.array(["a"]),
        np.array([None]),
        np.float16(1.0),
    ]
)
"""Values that are invalid for all fields, or nearly all."""


@st.composite
def spoiled(draw: st.DrawFn, name: str) -> Any:
    """Generate messages of one type, by full name, with junk in one place at any depth; or only junk."""
    return _spoil(draw, draw(messages(name)))


def _spoil(draw: st.DrawFn, value: Any) -> Any:
    if isinstance(value, list) and value and draw(st.booleans()):
        place = draw(st.integers(0, len(value) - 1))
        return [*value[:place], _spoil(draw, value[place]), *value[place + 1 :]]
    fields = dataclasses.fields(value) if dataclasses.is_dataclass(value) else ()
    names = [field.name for field in fields if field.init]
    if not names or not draw(st.integers(0, 9)):
        return draw(JUNK)
    name = draw(st.sampled_from(names))
    return dataclasses.replace(value, **{name: _spoil(draw, getattr(value, name))})
