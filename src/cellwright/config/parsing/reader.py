"""Keys of a configuration section, and the reader of single values with a diagnostic for each mistake.

Each method of the reader returns None after it has reported an error, so that the caller can continue and find more.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

from cellwright.config.parsing import entries, expressions, schema
from cellwright.config.parsing.python2 import dictionary_order, scalar_text
from cellwright.config.parsing.schema import Elsewhere, Schema, accepts
from cellwright.config.parsing.tree import (
    MAX_PROBLEMS,
    Entry,
    Items,
    Leaf,
    Located,
    Problems,
    Table,
    YamlNode,
    describe,
    shortened,
)
from cellwright.util.errors import ExpressionError, did_you_mean, suggestion
from cellwright.util.pose import Pose, Vector3

Read: TypeAlias = "Callable[[Reader, YamlNode], Any]"
"""Reader of one value, often a method of `Reader`; it returns None after it has reported an error."""

MAX_COORDINATE = 10_000.0
"""Maximum coordinate [m]; larger ones are typing errors."""
MAX_NAME_LENGTH = 200
"""Maximum length of any name, in characters."""
MAX_MESH_BYTES = 50 << 20
"""Maximum total size of the mesh files of one trial [bytes]."""
_NUMBER = re.compile(r"\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*", re.ASCII)


@dataclass(frozen=True, slots=True)
class Keys:
    """Entries of a section, each with the reader of its value, or without one if the section's own reader reads it.

    Attributes:
        required: mandatory entries.
        optional: optional entries.
        strict: the noun for an unknown entry in errors; if empty, an unknown entry is a warning.
        texts: name of the table of texts on the entries, in `entries.yaml`.
    """

    required: Mapping[str, Read | Elsewhere | None] = field(default_factory=dict)
    optional: Mapping[str, Read | Elsewhere | None] = field(default_factory=dict)
    strict: str = ""
    texts: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the entries."""
        return (*self.required, *self.optional)

    def schema(self) -> Schema:
        """Return the JSON Schema of the section."""
        readers = {**self.required, **self.optional}
        descriptions = {name: text.description for name, text in entries.texts(self.texts).items()}
        return schema.table_schema(readers, self.required, descriptions, strict=bool(self.strict))

    def read(self, table: Table, reader: Reader, others: Sequence[str] = ()) -> dict[str, Any]:
        """Return the values in a table by name, and report missing, unknown and refused ones.

        Entries in `others` are known too, but not read.
        """
        known = (*others, *self.names)
        if self.strict:
            reader.refuse_unknown(table, known, self.strict)
        else:
            reader.ignored(table, known)
        return self.values(table, reader)

    def values(self, table: Table, reader: Reader) -> dict[str, Any]:
        """Return the values as `read` does, without checking for unknown entries."""
        values: dict[str, Any] = {}
        for name, read in (*self.required.items(), *self.optional.items()):
            node = reader.required(table, name) if name in self.required else table.get(name)
            values[name] = read(reader, node) if node and callable(read) else None
        return {name: value for name, value in values.items() if value is not None}

    def complete(self, values: Collection[str]) -> bool:
        """Return whether each required entry that has a reader has a value."""
        return all(name in values for name, read in self.required.items() if callable(read))


@dataclass(frozen=True, slots=True)
class Placement:
    """Pose as written: `xyz` [m] and `rpy` [rad]; None where the file has none, which means zero."""

    xyz: Vector3 | None = None
    rpy: Vector3 | None = None

    @property
    def pose(self) -> Pose:
        """The pose, with zeros for missing values."""
        return Pose.from_rpy(self.xyz or (0.0, 0.0, 0.0), self.rpy or (0.0, 0.0, 0.0))


class Reader:
    """Reader of values that collects their errors."""

    def __init__(self, problems: Problems) -> None:
        self.problems = problems
        self._meshes: dict[Path, int] = {}

    def admit_mesh(self, path: Path) -> bool:
        """Return whether one more mesh file still fits the bound of all files of a trial."""
        self._meshes[path] = path.stat().st_size
        return sum(self._meshes.values()) <= MAX_MESH_BYTES

    def table(self, node: YamlNode) -> Table | None:
        """Return a mapping."""
        if isinstance(node, Table):
            return node
        empty = isinstance(node, Leaf) and node.value is None
        hint = "; write {} for none, or leave the entry out" if empty else ""
        self.problems.error(node, f"must be a mapping (got {describe(node)}){hint}")
        return None

    def entries(self, node: YamlNode) -> list[Entry]:
        """Return the entries of a mapping in the iteration order of the original."""
        table = self.table(node)
        return [table.entries[name] for name in dictionary_order(table.entries)] if table else []

    def tables(self, node: YamlNode) -> Iterator[tuple[Entry, str, Table]]:
        """Yield the entries of a mapping of mappings in that order, each with its name."""
        for entry in self.entries(node):
            name, table = self.text_key(entry), self.table(entry.value)
            if name is not None and table is not None:
                yield entry, name, table

    def required(self, table: Table, name: str, hint: str = "") -> YamlNode | None:
        """Return the value of a mandatory entry."""
        node = table.get(name)
        if node is None:
            similar = did_you_mean(name, [other for other in table.entries if isinstance(other, str)])
            if similar and not hint:
                hint = f"; is {similar.removeprefix('; did you mean ')} a misspelling of it"
            self.problems.error(table, f"the required entry {name!r} is missing{hint}")
        return node

    def ignored(self, table: Table, known: Collection[str]) -> None:
        """Warn of each entry that the original silently ignored."""
        for entry, similar in self.unknown(table, known):
            self.problems.warn(
                entry, f"unknown entry, ignored{similar and did_you_mean(similar, known)}", ignored=entry
            )

    def refuse_unknown(self, table: Table, known: Collection[str], kind: str = "entry") -> None:
        """Report each entry that is not among the known ones; the error calls it a `kind`."""
        for entry, similar in self.unknown(table, known):
            self.problems.error(entry, f"unknown {kind}{similar and suggestion(similar, known)}")

    @staticmethod
    def unknown(table: Table, known: Collection[str]) -> Iterator[tuple[Entry, str]]:
        """Yield the unknown entries, each with its name; with an empty one where no suggestion would be listed.

        The search for a similar name takes longer than parsing, so a file of thousands would stop a served cell.
        """
        unknown = (entry for entry in table.entries.values() if entry.name not in known)
        for number, entry in enumerate(unknown):
            yield entry, str(entry.name) if number < MAX_PROBLEMS else ""

    @accepts(schema.NAME)
    def name(self, node: YamlNode) -> str | None:
        """Return a name: a text, or a number, which becomes one."""
        if isinstance(node, Leaf) and isinstance(node.value, bool):
            self.problems.error(node, f"must be a name (got {describe(node)}); put it in quotes to use it as one")
        elif isinstance(node, Leaf) and isinstance(node.value, str | int | float):
            return self._readable(node, scalar_text(node.value))
        else:
            self.problems.error(node, f"must be a name (got {describe(node)})")
        return None

    def key(self, entry: Entry) -> str | None:
        """Return the key of an entry, as a name."""
        return self.name(Leaf(entry.name, entry.place, entry.key))

    def text_key(self, entry: Entry) -> str | None:
        """Return the key of an entry where the original accepted only a text."""
        if isinstance(entry.name, str):
            return self._readable(entry, entry.name)
        found = describe(Leaf(entry.name, entry.place, entry.key))
        self.problems.error(entry, f"must be a name (got {found}); put it in quotes to use it as one")
        return None

    def _readable(self, where: Located, name: str) -> str | None:
        """Return the name, or None if it cannot be printed or sent."""
        if name.isprintable() and len(name) <= MAX_NAME_LENGTH:
            return name
        self.problems.error(where, f"must be a name of at most {MAX_NAME_LENGTH} printable characters")
        return None

    @accepts(schema.NUMBER)
    def number(self, node: YamlNode) -> float | None:
        """Return a finite number that is not evaluated; it may stand in quotes."""
        match node:
            case Leaf(value=bool()):
                pass
            case Leaf(value=int() | float() as number):
                return self.finite(node, number)
            case Leaf(value=str(text)) if _NUMBER.fullmatch(text):
                return self.finite(node, float(text))
        self.problems.error(node, f"must be a number (got {describe(node)})")
        return None

    def finite(self, where: Located, number: float) -> float | None:
        """Return the number, or None if it is not finite."""
        try:
            if math.isfinite(number):
                return number
        except OverflowError:
            pass
        self.problems.error(where, "must be a finite number")
        return None

    @accepts({**schema.NUMBER, "minimum": 0})
    def not_negative(self, node: YamlNode) -> float | None:
        """Return a number that is 0 or more."""
        number = self.number(node)
        if number is not None and number < 0:
            self.problems.error(node, f"must not be negative (got {number:g})")
            return None
        return None if number is None else float(number)

    @accepts({"type": "boolean"})
    def boolean(self, node: YamlNode) -> bool | None:
        """Return true or false."""
        if isinstance(node, Leaf) and isinstance(node.value, bool):
            return node.value
        self.problems.error(node, f"must be true or false (got {describe(node)})")
        return None

    @accepts({"type": "integer", "minimum": 0})
    def whole(self, node: YamlNode, *, minimum: int = 0) -> int | None:
        """Return a whole number of at least `minimum`."""
        if isinstance(node, Leaf) and isinstance(node.value, int):
            if isinstance(node.value, bool):
                self.problems.warn(node, f"{describe(node)} counts as {int(node.value)}")
            if node.value >= minimum:
                return int(node.value)
            self.problems.error(node, f"must be at least {minimum} (got {node.value})")
            return None
        hint = ""
        if isinstance(node, Leaf) and isinstance(node.value, str | float) and _NUMBER.fullmatch(str(node.value)):
            hint = f"; did you mean {float(node.value):.0f}"
        self.problems.error(node, f"must be a whole number (got {describe(node)}){hint}")
        return None

    @accepts(schema.array(schema.EXPRESSION, 3, 3))
    def vector(self, node: YamlNode) -> Vector3 | None:
        """Return three numbers or expressions; values that cannot be evaluated have been reported before."""
        if not isinstance(node, Items):
            return None
        try:
            numbers = [expressions.expression_value(item) for item in node.items]
        except ExpressionError:
            return None
        if len(numbers) != 3:
            self.problems.error(node, f"must be a list of three numbers (got a list of {len(numbers)})")
            return None
        return (numbers[0], numbers[1], numbers[2])

    @accepts(schema.array(schema.EXPRESSION, 3, 3))
    def position(self, node: YamlNode) -> Vector3 | None:
        """Return three coordinates [m], which may be expressions."""
        vector = self.vector(node)
        return vector if vector is None or self.check_coordinates(node, vector) else None

    def check_coordinates(self, where: Located, numbers: Iterable[float]) -> bool:
        """Return whether coordinates [m] are plausible for a cell; report them if not."""
        far = [number for number in numbers if not abs(number) <= MAX_COORDINATE]
        if not far:
            return True
        self.problems.error(where, f"coordinates must be within ±{MAX_COORDINATE:g} m (got {far[0]:g})")
        return False

    @accepts(lambda: _PLACEMENT.schema())
    def placement(self, node: YamlNode) -> Placement | None:
        """Return a pose as written: a mapping with `xyz` and `rpy`, either of which may be missing."""
        table = self.table(node)
        if table is None:
            return None
        return Placement(**_PLACEMENT.read(table, self))

    @accepts(lambda: _PLACEMENT.schema())
    def pose(self, node: YamlNode) -> Pose | None:
        """Return the pose of a placement."""
        placement = self.placement(node)
        return placement.pose if placement else None


_PLACEMENT: Keys = Keys(optional={"xyz": Reader.position, "rpy": Reader.vector})


def one_of(known: Collection[str], kind: str = "value") -> Read:
    """Return a reader of one of several words; the error calls any other an unknown `kind`."""

    @accepts(schema.words(known))
    def read(reader: Reader, node: YamlNode) -> str | None:
        name = reader.name(node)
        if name is None or name in known:
            return name
        reader.problems.error(node, f"unknown {kind} {shortened(name)!r}{suggestion(name, known)}")
        return None

    return read


def any_name(suggested: Collection[str]) -> Read:
    """Return a reader of any name; editors suggest some of them."""

    @accepts(schema.suggested(suggested))
    def read(reader: Reader, node: YamlNode) -> str | None:
        return reader.name(node)

    return read


def choice(known: Sequence[str]) -> Read:
    """Return a reader of one of a few words; the error states the value found."""

    @accepts(schema.words(known))
    def read(reader: Reader, node: YamlNode) -> str | None:
        if isinstance(node, Leaf) and node.value in known:
            return str(node.value)
        hint = did_you_mean(node.value, known) if isinstance(node, Leaf) and isinstance(node.value, str) else ""
        reader.problems.error(node, f"must be {' or '.join(known)} (got {describe(node)}){hint}")
        return None

    return read


def numbers(count: int, names: str) -> Read:
    """Return a reader of a list of `count` numbers; the error calls them by their `names`."""

    @accepts(schema.array(schema.NUMBER, count, count))
    def read(reader: Reader, node: YamlNode) -> tuple[float, ...] | None:
        if not isinstance(node, Items) or len(node.items) != count:
            found = f"a list of {len(node.items)}" if isinstance(node, Items) else describe(node)
            reader.problems.error(node, f"must be a list of {count} numbers, {names} (got {found})")
            return None
        found_numbers = [reader.number(item) for item in node.items]
        return None if None in found_numbers else tuple(float(each) for each in found_numbers if each is not None)

    return read


def number(minimum: float, maximum: float, unit: str = "") -> Read:
    """Return a reader of a number within bounds, as a float."""
    return _bounded(Reader.number, float, "g", minimum, maximum, unit)


def whole(minimum: int, maximum: int, unit: str = "") -> Read:
    """Return a reader of a whole number within bounds."""
    return _bounded(Reader.whole, int, "d", minimum, maximum, unit)


def _bounded(read: Read, kind: type, form: str, minimum: float, maximum: float, unit: str) -> Read:
    @accepts(schema.bounded(schema.schema_of(read), minimum, maximum))
    def bounded(reader: Reader, node: YamlNode) -> Any:
        found = read(reader, node)
        if found is None or minimum <= found <= maximum:
            return None if found is None else kind(found)
        bounds = f"{minimum:{form}} to {maximum:{form}} {unit}".rstrip()
        reader.problems.error(node, f"must be from {bounds} (got {found:{form}})")
        return None

    return bounded


def section(keys: Keys, make: Callable[..., Any]) -> Read:
    """Return a reader of a mapping with keys, which calls `make` with the values if all required ones are there."""

    @accepts(keys.schema)
    def read(reader: Reader, node: YamlNode) -> Any:
        table = reader.table(node)
        values = keys.read(table, reader) if table else {}
        return make(**values) if table and keys.complete(values) else None

    return read
