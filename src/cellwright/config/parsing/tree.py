"""Tree of configuration values that know their file, line and key, and the problems found in them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import date
from pathlib import Path
from typing import Any, Literal, Protocol, TypeAlias, Union

from cellwright.util.errors import DescriptionError, one_printable_line

Severity: TypeAlias = Literal["error", "warning"]

MAX_PROBLEMS = 1000
"""Maximum number of errors, and of warnings, that are listed for one trial or robot; the others are counted."""
Scalar: TypeAlias = str | int | float | bool | date | bytes | None
YamlNode: TypeAlias = Union["Leaf", "Items", "Table"]


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """Place in a file: the file's position among those given, its name, and the line from 1 (0: the whole file)."""

    file: int
    path: str
    line: int

    def __str__(self) -> str:
        return f"{self.path}:{self.line}" if self.line else self.path


@dataclass(frozen=True, slots=True)
class Problem:
    """Error or warning about a file.

    Attributes:
        key: dotted path to the value; empty for the file itself.
        ignored: dotted path to a value that is ignored therefore; empty if none is.
    """

    place: Place
    key: str
    message: str
    severity: Severity = "error"
    ignored: str = ""

    @property
    def path(self) -> str:
        """The file's name as given."""
        return self.place.path

    @property
    def line(self) -> int:
        """The line in that file, from 1; 0 for the file as a whole."""
        return self.place.line

    def __str__(self) -> str:
        text = ": ".join(part for part in (str(self.place), self.key, self.message) if part)
        # A problem stays one printable line, whatever characters a file contains.
        return one_printable_line(text)


def refusal(path: Path, line: int, message: str) -> DescriptionError:
    """Return the error for a file that cannot be read at all; line 0 is the whole file."""
    return DescriptionError([Problem(Place(0, str(path), line), "", message)])


class Located(Protocol):
    """Anything that knows its place."""

    @property
    def place(self) -> Place:
        """The place."""
        ...

    @property
    def key(self) -> str:
        """The dotted path to it."""
        ...


@dataclass(frozen=True, slots=True)
class Definition:
    """Place in a file where something is defined, and the dotted path to it."""

    place: Place
    key: str


class Problems:
    """Collector of problems, so that one error lists all of a file."""

    def __init__(self) -> None:
        self._found: list[Problem] = []
        self.error_count = 0
        """Number of errors noted, including repeated ones."""

    def error(self, where: Located, message: str) -> None:
        """Add an error, which makes the file unusable."""
        self.add(Problem(where.place, where.key, message, "error"))

    def warn(self, where: Located, message: str, *, ignored: Located | None = None) -> None:
        """Add a warning for the file's author; `ignored` is the value that is ignored therefore, if one is."""
        self._found.append(Problem(where.place, where.key, message, "warning", ignored.key if ignored else ""))

    def refuse(self, refused: Callable[[Problem], Problem | None]) -> None:
        """Replace warnings by errors: those for which `refused` returns one."""
        for number, problem in enumerate(self._found):
            if problem.severity == "warning" and (error := refused(problem)):
                self._found[number] = error
                self.error_count += 1

    def add(self, problem: Problem) -> None:
        """Add a problem."""
        self._found.append(problem)
        self.error_count += problem.severity == "error"

    @property
    def errors(self) -> tuple[Problem, ...]:
        """Errors, in the order of files and lines."""
        return self._of("error")

    @property
    def warnings(self) -> tuple[Problem, ...]:
        """Warnings, in the order of files and lines."""
        return self._of("warning")

    def _of(self, severity: Severity) -> tuple[Problem, ...]:
        found = dict.fromkeys(problem for problem in self._found if problem.severity == severity)
        ordered = sorted(found, key=lambda problem: problem.place)
        if len(ordered) > MAX_PROBLEMS:
            message = f"{len(ordered) - MAX_PROBLEMS} more {severity}s are not listed"
            ordered[MAX_PROBLEMS:] = [Problem(ordered[MAX_PROBLEMS].place, "", message, severity)]
        return tuple(ordered)


@dataclass(frozen=True, slots=True)
class Leaf:
    """Single value."""

    value: Scalar
    place: Place
    key: str


@dataclass(frozen=True, slots=True)
class Items:
    """List of values."""

    items: tuple[YamlNode, ...]
    place: Place
    key: str


@dataclass(frozen=True, slots=True)
class Entry:
    """Entry of a table. `place` is its key's, `key` the dotted path to it, `name` the key itself, of any kind."""

    name: Scalar
    value: YamlNode
    place: Place
    key: str


@dataclass(frozen=True, slots=True)
class Table:
    """Mapping, in the order of the file."""

    place: Place
    key: str
    entries: dict[Scalar, Entry] = field(default_factory=dict)

    def get(self, name: str) -> YamlNode | None:
        """Return the value under a key, or None if there is no such key (an empty value is a `Leaf` of None)."""
        entry = self.entries.get(name)
        return entry.value if entry else None

    def __contains__(self, name: object) -> bool:
        return name in self.entries


def with_on(table: Table) -> Table:
    """Return a table whose entry `on` has that name: in YAML 1.1 an unquoted `on` is true."""
    entry = table.entries.get(True)
    if entry is None or "on" in table.entries:
        return table
    key = f"{table.key}.on" if table.key else "on"
    value = replace(entry.value, key=key) if isinstance(entry.value, Leaf) else entry.value
    own = Entry("on", value, entry.place, key)
    entries = {name: own if each is entry else each for name, each in table.entries.items()}
    return Table(table.place, table.key, {"on" if name is True else name: each for name, each in entries.items()})


def children(node: YamlNode) -> tuple[YamlNode, ...]:
    """Return the items of a list, or the values of a table."""
    if isinstance(node, Items):
        return node.items
    return tuple(entry.value for entry in node.entries.values()) if isinstance(node, Table) else ()


def describe(node: YamlNode) -> str:
    """Return the kind of a value, for messages."""
    match node:
        case Table():
            return "a mapping"
        case Items():
            return "a list"
        case Leaf(value=None):
            return "an empty value"
        case Leaf(value=bool(value)):
            return f"the boolean {str(value).lower()}"
        case Leaf(value=str(value)):
            return f"the text {shortened(repr(value))}"
        case Leaf(value=int() | float()):
            return f"the number {shortened(str(node.value))}"
        case _:
            return f"the value {shortened(str(node.value))}"


def shortened(text: str, length: int = 60) -> str:
    """Return the text, truncated to `length` characters."""
    return text if len(text) <= length else text[: length - 1] + "…"


def plain(node: YamlNode) -> Any:
    """Return a node as plain data: dicts, lists and scalars."""
    match node:
        case Table():
            return {str(entry.name): plain(entry.value) for entry in node.entries.values()}
        case Items():
            return [plain(item) for item in node.items]
        case Leaf():
            return node.value
