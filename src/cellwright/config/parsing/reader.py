"""Declared keys of a configuration section, and the reader of single values with a diagnostic for each mistake.

A reader passes `names` on to whatever tells unknown entries; the pages of the documentation have the rest.

Each method returns None after it has reported an error, so that a caller can go on and find more.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from cellwright.config.parsing import expressions
from cellwright.config.parsing.raw_trial import Placement, dictionary_order, scalar_text
from cellwright.config.parsing.tree import Entry, Items, Leaf, Located, Node, Problems, Table, described
from cellwright.util.errors import ExpressionError, did_you_mean
from cellwright.util.pose import Vector3

REQUIRED = "required"
"""The default of an entry that must be there."""


@dataclass(frozen=True, slots=True)
class Key:
    """One entry.

    Attributes:
        name: as it stands in the file.
        value: what is written there, with its unit.
        meaning: what that does.
        default: what is meant when it is left out: a value, or a remark in words; `REQUIRED` where it must be there.
    """

    name: str
    value: str
    meaning: str
    default: object = "none"


class Keys:
    """The entries of a section, in the order of the reference."""

    def __init__(self, *keys: Key) -> None:
        self._keys = keys

    def __iter__(self) -> Iterator[Key]:
        return iter(self._keys)

    @property
    def names(self) -> tuple[str, ...]:
        """What they are called."""
        return tuple(key.name for key in self)

    @property
    def required(self) -> tuple[str, ...]:
        """Those that must be there."""
        return tuple(key.name for key in self if key.default == REQUIRED)

    def table(self, prefix: str = "") -> str:
        """The entries as a table in Markdown.

        Args:
            prefix: what stands before each name, such as `arm.`.
        """
        rows = [
            f"| `{prefix}{key.name}` | {key.value} | {key.meaning} | {_default_text(key.default)} |" for key in self
        ]
        return "\n".join(["| entry | value | meaning | default |", "|---|---|---|---|", *rows, ""])


def _default_text(default: object) -> str:
    """A default as a file would have it, or in words."""
    if isinstance(default, bool):
        return str(default).lower()
    return f"{default:g}" if isinstance(default, int | float) else str(default)


FARTHEST = 10_000.0
"""Largest coordinate [m]; what lies beyond is a slip of the pen."""

LONGEST_NAME = 200
"""Longest name of anything, in characters."""

MAX_MESH_BYTES = 50 << 20
"""Largest mesh files of one trial together [bytes]."""

_NUMBER = re.compile(r"\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*", re.ASCII)


class Reader:
    """Reads values and collects what is wrong with them."""

    def __init__(self, problems: Problems) -> None:
        self.problems = problems
        self._meshes: dict[Path, int] = {}

    def admit_mesh(self, path: Path) -> bool:
        """Whether one more mesh file still fits the bound of all files of a trial together."""
        self._meshes[path] = path.stat().st_size
        return sum(self._meshes.values()) <= MAX_MESH_BYTES

    def table(self, node: Node) -> Table | None:
        """A mapping."""
        if isinstance(node, Table):
            return node
        empty = isinstance(node, Leaf) and node.value is None
        hint = "; write {} for none, or leave the entry out" if empty else ""
        self.problems.error(node, f"must be a mapping, not {described(node)}{hint}")
        return None

    def entries(self, table: Table) -> list[Entry]:
        """The entries in the order in which the original came upon them."""
        order = dictionary_order(table.entries)
        return [entry for name in order for entry in (table.entries[name],)]  # type: ignore[index]

    def required(self, table: Table, name: str, hint: str = "") -> Node | None:
        """The value of an entry that must be there."""
        node = table.get(name)
        if node is None:
            others = [other for other in table.entries if isinstance(other, str)]
            suggestion = hint or _misspelt(name, others)
            self.problems.error(table, f"the required entry {name!r} is missing{suggestion}")
        return node

    def ignored(self, table: Table, known: Sequence[str]) -> None:
        """Warn of every entry that the original passed over."""
        for entry in table.entries.values():
            if entry.name not in known:
                self.problems.warn(entry, f"unknown entry, ignored{did_you_mean(str(entry.name), known)}")

    def name(self, node: Node) -> str | None:
        """A name: a text, or a number, which becomes one."""
        if isinstance(node, Leaf) and isinstance(node.value, bool):
            self.problems.error(node, f"must be a name, not {described(node)}; put it in quotes if it is one")
        elif isinstance(node, Leaf) and isinstance(node.value, str | int | float):
            return self._readable(node, scalar_text(node.value))
        else:
            self.problems.error(node, f"must be a name, not {described(node)}")
        return None

    def key(self, entry: Entry) -> str | None:
        """The key of an entry, as a name."""
        return self.name(Leaf(entry.name, entry.place, entry.key))

    def text_key(self, entry: Entry) -> str | None:
        """The key of an entry where the original took nothing but a text."""
        if isinstance(entry.name, str):
            return self._readable(entry, entry.name)
        found = described(Leaf(entry.name, entry.place, entry.key))
        self.problems.error(entry, f"must be a name, not {found}; put it in quotes if it is one")
        return None

    def _readable(self, where: Located, name: str) -> str | None:
        """The name, unless it could not be shown or sent to anybody."""
        if name.isprintable() and len(name) <= LONGEST_NAME:
            return name
        self.problems.error(where, f"must be a name of at most {LONGEST_NAME} characters that can be printed")
        return None

    def number(self, node: Node) -> float | None:
        """A finite number that is not computed; it may stand in quotes."""
        match node:
            case Leaf(value=bool()):
                pass
            case Leaf(value=int() | float() as number):
                return self.finite(node, number)
            case Leaf(value=str(text)) if _NUMBER.fullmatch(text):
                return self.finite(node, float(text))
        self.problems.error(node, f"must be a number, not {described(node)}")
        return None

    def finite(self, where: Located, number: float) -> float | None:
        """The number, unless it is none that can be reckoned with."""
        try:
            if math.isfinite(number):
                return number
        except OverflowError:
            pass
        self.problems.error(where, "must be a finite number")
        return None

    def whole(self, node: Node, *, least: int = 0) -> int | None:
        """A whole number of at least `least`."""
        if isinstance(node, Leaf) and isinstance(node.value, int):
            if isinstance(node.value, bool):
                self.problems.warn(node, f"{described(node)} counts as {int(node.value)}")
            if node.value >= least:
                return int(node.value)
            self.problems.error(node, f"must be at least {least}, not {node.value}")
            return None
        hint = ""
        if isinstance(node, Leaf) and isinstance(node.value, str | float) and _NUMBER.fullmatch(str(node.value)):
            hint = f"; did you mean {float(node.value):.0f}"
        self.problems.error(node, f"must be a whole number, not {described(node)}{hint}")
        return None

    def vector(self, node: Node) -> Vector3 | None:
        """Three numbers or expressions; values that cannot be computed have been reported before."""
        if not isinstance(node, Items):
            return None
        try:
            numbers = [expressions.expression_value(item) for item in node.items]
        except ExpressionError:
            return None
        if len(numbers) != 3:
            self.problems.error(node, f"must be a list of three numbers, not of {len(numbers)}")
            return None
        return (numbers[0], numbers[1], numbers[2])

    def position(self, node: Node) -> Vector3 | None:
        """Three coordinates [m], which may be expressions."""
        vector = self.vector(node)
        return vector if vector is None or self.near(node, vector) else None

    def coordinates(self, node: Node, least: int) -> tuple[float, ...] | None:
        """At least `least` plain numbers [m]; whole numbers stay whole, for they are divided as such."""
        if not isinstance(node, Items):
            self.problems.error(node, f"must be a list of three numbers, not {described(node)}")
            return None
        if len(node.items) < least:
            self.problems.error(node, f"must be a list of three numbers, not of {len(node.items)}")
            return None
        if len(node.items) > 3:
            self.problems.warn(node, "more than three numbers; the others are ignored")
        numbers: list[float] = []
        for item in node.items[:3]:
            if isinstance(item, Leaf) and isinstance(item.value, int | float):
                number = self.finite(item, item.value)
            else:
                number = None
                self.problems.error(item, f"must be a plain number, not {described(item)}; this list is not computed")
            if number is not None:
                numbers.append(number)
        complete = len(numbers) == len(node.items[:3])
        return tuple(numbers) if complete and self.near(node, numbers) else None

    def near(self, where: Located, numbers: Iterable[float]) -> bool:
        """Whether coordinates [m] are such as a cell can have; reported when not."""
        if all(abs(number) <= FARTHEST for number in numbers):
            return True
        self.problems.error(where, f"lies more than {FARTHEST:g} m away")
        return False

    def placement(self, node: Node) -> Placement | None:
        """A pose: a mapping with `xyz` and `rpy`, either of which may be missing."""
        table = self.table(node)
        if table is None:
            return None
        self.ignored(table, ("xyz", "rpy"))
        xyz_node, rpy_node = table.get("xyz"), table.get("rpy")
        xyz = self.position(xyz_node) if xyz_node else None
        rpy = self.vector(rpy_node) if rpy_node else None
        return Placement(xyz, rpy)


def _misspelt(name: str, others: list[str]) -> str:
    """A remark when one of the entries that are there looks like the one that is missing."""
    tail = did_you_mean(name, others)
    return tail.replace("; did you mean ", "; is it spelt ") if tail else ""
