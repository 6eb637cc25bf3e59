"""Readers of the names in a key map: those of the cell, or their places from 1 on, which presets give."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cellwright.clients.policies.key_map import Cell
from cellwright.config.parsing import reader as read
from cellwright.config.parsing.reader import Keys, Read, Reader
from cellwright.config.parsing.tree import Items, Leaf, Table, YamlNode, describe

ALL = "all"
"""Word for all channels of a cell."""
MAX_COUNT = 10_000


def named(known: Sequence[str], kind: str, aliases: Mapping[str, str] | None = None) -> Read:
    """Return a reader of a name, or of its place among the known ones; `aliases` are further names."""
    by_name = read.one_of((*known, *(aliases or {})), kind)

    def name(reader: Reader, node: YamlNode) -> str | None:
        number = _place(node, known)
        if number is None:
            found: str | None = by_name(reader, node)
            return found if found is None else (aliases or {}).get(found, found)
        if 1 <= number <= len(known):
            return known[number - 1]
        there = f"there are {len(known)}: {', '.join(known)}" if known else "there is none"
        reader.problems.error(node, f"no {kind} {number} here; {there}")
        return None

    return name


def channels(cell: Cell) -> Read:
    """Return a reader of channels: a list, the word for all, or an arm, whose joints they are."""
    known = read.one_of(cell.space.names, "channel")
    of_arm = Keys({"arm": named(tuple(cell.arms), "arm")}, {"count": read.whole(1, MAX_COUNT)}, strict="entry")

    def names(reader: Reader, node: YamlNode) -> tuple[str, ...] | None:
        if isinstance(node, Leaf) and node.value == ALL:
            return cell.space.names
        if isinstance(node, Table):
            return joints(reader, node)
        if not isinstance(node, Items) or not node.items:
            reader.problems.error(node, f"must be {ALL}, a list of channels, or {{arm: NAME}} (got {describe(node)})")
            return None
        found = [known(reader, item) for item in node.items]
        return None if None in found else tuple(found)

    def joints(reader: Reader, table: Table) -> tuple[str, ...] | None:
        values = of_arm.read(table, reader)
        if not of_arm.complete(values):
            return None
        found = tuple(cell.arms[values["arm"]])
        if len(found) != values.get("count", len(found)):
            got = f"got {len(found)}: {', '.join(found)}"
            reader.problems.error(table, f"the arm {values['arm']} must have {values['count']} joints ({got})")
            return None
        return found

    return names


def is_beyond(node: YamlNode | None, known: Sequence[str]) -> bool:
    """Return whether a node gives the place of something that the cell lacks."""
    number = None if node is None else _place(node, known)
    return number is not None and number > len(known)


def _place(node: YamlNode, known: Sequence[str]) -> int | None:
    """Return the place that a node gives; None for a name, which may look like a number."""
    value = node.value if isinstance(node, Leaf) else None
    return value if type(value) is int and str(value) not in known else None
