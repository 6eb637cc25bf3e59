"""Tree of configuration values that know their file, line and key, and the problems found in them."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Literal, Protocol, TypeAlias

from cellwright.util.errors import DescriptionError

Severity: TypeAlias = Literal["error", "warning"]

MOST_TOLD = 1000
"""Most errors, and most warnings, that are told of one trial or robot; the others are counted."""


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """Where something stands: the file's position among those given, its name, and the line from 1 (0: the whole)."""

    file: int
    path: str
    line: int

    def __str__(self) -> str:
        return f"{self.path}:{self.line}" if self.line else self.path


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that somebody should know about a file; `key` is the dotted way to it, empty for the file itself."""

    place: Place
    key: str
    message: str
    severity: Severity = "error"

    @property
    def path(self) -> str:
        """The file's name as it was given."""
        return self.place.path

    @property
    def line(self) -> int:
        """The line in that file, from 1; 0 when the file as a whole is meant."""
        return self.place.line

    def __str__(self) -> str:
        text = ": ".join(part for part in (str(self.place), self.key, self.message) if part)
        # Whatever a file smuggles in, a problem stays one line that any terminal can show.
        return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def refusal(path: Path, line: int, message: str) -> DescriptionError:
    """The error that says that a file cannot be read at all; line 0 is the whole file."""
    return DescriptionError([Problem(Place(0, str(path), line), "", message)])


class Located(Protocol):
    """Anything that knows where it was written."""

    @property
    def place(self) -> Place:
        """Where it stands."""
        ...

    @property
    def key(self) -> str:
        """The dotted way to it."""
        ...


class Problems:
    """Collects what is found while a file is read, so that all of it can be said at once."""

    def __init__(self) -> None:
        self._found: list[Problem] = []
        self.error_count = 0
        """How many errors were noted, those that say the same counted each time."""

    def error(self, where: Located, message: str) -> None:
        """Note something that makes the file unusable."""
        self.add(Problem(where.place, where.key, message, "error"))

    def warn(self, where: Located, message: str) -> None:
        """Note something that the file's author should know, though it can be read."""
        self._found.append(Problem(where.place, where.key, message, "warning"))

    def add(self, problem: Problem) -> None:
        """Note a problem that is at hand."""
        self._found.append(problem)
        self.error_count += problem.severity == "error"

    @property
    def errors(self) -> tuple[Problem, ...]:
        """The errors, in the order of files and lines."""
        return self._of("error")

    @property
    def warnings(self) -> tuple[Problem, ...]:
        """The warnings, in the order of files and lines."""
        return self._of("warning")

    def _of(self, severity: Severity) -> tuple[Problem, ...]:
        found = dict.fromkeys(problem for problem in self._found if problem.severity == severity)
        told = sorted(found, key=lambda problem: problem.place)
        if len(told) > MOST_TOLD:
            message = f"{len(told) - MOST_TOLD} more {severity}s besides these"
            told[MOST_TOLD:] = [Problem(told[MOST_TOLD].place, "", message, severity)]
        return tuple(told)


Scalar: TypeAlias = str | int | float | bool | date | bytes | None


@dataclass(frozen=True, slots=True)
class Leaf:
    """A single value."""

    value: Scalar
    place: Place
    key: str


@dataclass(frozen=True, slots=True)
class Items:
    """A list."""

    items: tuple[Node, ...]
    place: Place
    key: str


@dataclass(frozen=True, slots=True)
class Entry:
    """One entry of a table. `place` is its key's; `key` the dotted way to it; `name` the key itself, of any kind."""

    name: Scalar
    value: Node
    place: Place
    key: str


@dataclass(frozen=True, slots=True)
class Table:
    """A mapping, in the order of the file."""

    place: Place
    key: str
    entries: dict[Scalar, Entry] = field(default_factory=dict)

    def get(self, name: str) -> Node | None:
        """The value under a key, or None where there is no such key (an empty value is a `Leaf` of None)."""
        entry = self.entries.get(name)
        return entry.value if entry else None

    def __contains__(self, name: object) -> bool:
        return name in self.entries


Node: TypeAlias = Leaf | Items | Table


def children(node: Node) -> tuple[Node, ...]:
    """The items of a list, or the values of a table."""
    if isinstance(node, Items):
        return node.items
    return tuple(entry.value for entry in node.entries.values()) if isinstance(node, Table) else ()


def described(node: Node) -> str:
    """What kind of value stands there, for messages."""
    match node:
        case Table():
            return "a mapping"
        case Items():
            return "a list"
        case Leaf(value=None):
            return "empty"
        case Leaf(value=bool(value)):
            return f"the truth value {str(value).lower()}"
        case Leaf(value=str(value)):
            return f"the text {shortened(repr(value))}"
        case Leaf(value=int() | float()):
            return f"the number {shortened(str(node.value))}"
        case _:
            return f"the value {shortened(str(node.value))}"


def shortened(text: str, length: int = 60) -> str:
    """The text, cut where it would flood a message."""
    return text if len(text) <= length else text[: length - 1] + "…"
