"""Each place of the cell stands once: no file beside the layout has its numbers or the names of its bins and AGVs.

The numbers are those of the layout of 2017 that nothing else is likely to have: with `LONG` digits after the point, or
with two and above 1. What is far from the origin of a literal pose counts, too. A literal that is no place has a line
in `EXCEPTIONS` that says what it is.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from tests.support.places import LAYOUT

PACKAGE = Path(__file__).parents[3] / "src" / "cellwright"
LAYOUTS = "config/layout/"
"""Folder that has the layouts."""

LONG = 3
"""Digits after the point from which a number is a place, if the layout has it."""

EXCEPTIONS: dict[str, tuple[set[float | str], str]] = {
    "cell/devices/range_sensors.py": ({0.725}, "range of the laser profiler"),
    "config/ur10.py": ({3.15}, "speed limit of the elbow"),
    "cell/model/arm_looks.py": ({0.535}, "end of a ring on the upper arm"),
    "cell/model/bins.py": ({0.725}, "height to which the other heights of the original's bin belong"),
    "clients/agents/kitter/workplace.py": ({"agv"}, "name by which an AGV is one of 2017 in texts for people"),
    "clients/client/client.py": ({"agv"}, "service of an AGV, by the number that the caller gives"),
    "viewer/web/cell_panels.py": ({"agv", "kit_tray_"}, "services of the AGVs that the panel lists"),
}
"""Literals of the layout in other files, and what they are there."""

PENDING = {"cell/model/furniture.py", "cli/run/remote.py"}
"""Files that still know places of 2017."""

_WORDS = re.compile(r"[A-Za-z]\w*")
_POSES = ("Pose", "from_rpy", "at")
_FAR = 0.6
"""A literal pose further than this [m] from its frame's origin, along x or y, is a place of a cell."""


def numbers(value: Any) -> Iterator[float]:
    """Yield the numbers of a value of the layout, but for quaternions and colours."""
    if isinstance(value, float):
        yield abs(value)
    elif isinstance(value, tuple):
        for each in value:
            yield from numbers(each)
    elif is_dataclass(value):
        for each in fields(value):
            if each.name not in ("quaternion", "colour"):
                yield from numbers(getattr(value, each.name))


def is_telling(number: float) -> bool:
    """Return whether hardly anything else has this number."""
    text = repr(number)
    digits = len(text.partition(".")[2])
    return number > 0.1 and "e" not in text and (digits >= LONG or (digits == 2 and number > 1.0))


PLACES = (LAYOUT.bins, LAYOUT.belts, LAYOUT.carriers, LAYOUT.arms)
NUMBERS = frozenset(filter(is_telling, numbers(PLACES))) | {LAYOUT.belts[0].surface}
NAMES = frozenset(
    {
        *(each.name for each in LAYOUT.bins),
        *(each.name for each in LAYOUT.carriers),
        *(each.body for each in LAYOUT.belts),
        *(each.tray_name for each in LAYOUT.carriers),
    }
)
PATTERNS = ("agv", "bin", "kit_tray_")
"""Texts before a number that make such a name."""


def literals(source: str) -> Iterator[tuple[int, float | str]]:
    """Yield line and value of each literal that only the layout should have."""
    tree = ast.parse(source)
    prose = {
        id(each.value) for each in ast.walk(tree) if isinstance(each, ast.Expr) and isinstance(each.value, ast.Constant)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and id(node) not in prose:
            if isinstance(node.value, float) and node.value in NUMBERS:
                yield node.lineno, node.value
            elif isinstance(node.value, str):
                yield from ((node.lineno, word) for word in _WORDS.findall(node.value) if _is_name(word))
        elif isinstance(node, ast.JoinedStr):
            yield from ((node.lineno, text) for text in _made_names(node))
        elif isinstance(node, ast.Call):
            yield from ((node.lineno, number) for number in _far(node))


def _is_name(word: str) -> bool:
    return word in NAMES or any(word.startswith(f"{name}_") for name in NAMES)


def _made_names(text: ast.JoinedStr) -> Iterator[str]:
    """Yield the beginnings of names that a text makes with a number."""
    for part, after in zip(text.values, text.values[1:], strict=False):
        if isinstance(part, ast.Constant) and isinstance(after, ast.FormattedValue):
            words = re.findall(r"[A-Za-z_]+$", str(part.value))
            yield from (word for word in words if word in PATTERNS)


def _far(call: ast.Call) -> Iterator[float]:
    """Yield a number of a literal pose that is too far from its frame for a shape of a body."""
    name = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
    if name in _POSES and call.args:
        position = call.args[0].elts[:2] if isinstance(call.args[0], ast.Tuple) else call.args[:2]
        for each in position:
            node = each.operand if isinstance(each, ast.UnaryOp) else each
            if isinstance(node, ast.Constant) and isinstance(node.value, float) and node.value > _FAR:
                yield node.value
                return


@cache
def found() -> dict[str, dict[float | str, int]]:
    """Return the literals of the package by file, each with a line."""
    files: dict[str, dict[float | str, int]] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        if not name.startswith(LAYOUTS):
            for line, value in literals(path.read_text()):
                files.setdefault(name, {}).setdefault(value, line)
    return files


@pytest.mark.slow
def test_no_place_stands_outside_the_layout() -> None:
    unexpected = [
        f"{file}:{line}: {value!r} is a place of the cell of 2017; take it from the layout"
        for file, values in found().items()
        for value, line in values.items()
        if file not in PENDING and value not in EXCEPTIONS.get(file, (set(), ""))[0]
    ]
    assert not unexpected, "\n".join(unexpected)


@pytest.mark.slow
def test_each_exception_is_needed() -> None:
    present = found()
    spare = {
        file: sorted(map(str, values - present.get(file, {}).keys()))
        for file, (values, _) in EXCEPTIONS.items()
        if values - present.get(file, {}).keys()
    }
    assert not spare
    assert all(reason for _, reason in EXCEPTIONS.values())


def test_literals_of_layout_are_found() -> None:
    source = '''
def place():
    """bin7 at 0.725"""
    x = 0.725, -14.62206, 0.3
    return "agv1_load_point", f"the bin{x}"
'''
    assert set(literals(source)) == {(4, 0.725), (4, 14.62206), (5, "agv1_load_point"), (5, "bin")}
    assert list(literals("Pose((0.3, -3.3, 0.75))\nPose((0.1, 0.2, 3.3))\nat(5.0, z=0.2)")) == [(1, 3.3), (3, 5.0)]
