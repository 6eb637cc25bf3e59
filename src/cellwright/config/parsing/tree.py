"""YAML as a tree of values that know where they were written and how one gets to them."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import date
from typing import TypeAlias

from cellwright.config.parsing.problems import Place

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


def key_text(name: Scalar, length: int = 80) -> str:
    """A key as it stands in messages, not too long."""
    return shortened(str(name), length)


def shortened(text: str, length: int = 60) -> str:
    """The text, cut where it would flood a message."""
    return text if len(text) <= length else text[: length - 1] + "…"
