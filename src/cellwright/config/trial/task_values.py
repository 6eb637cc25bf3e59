"""Readers of single values of a task, for the tables of its keys."""

import math
from typing import Any

from cellwright.config.parsing import schema
from cellwright.config.parsing.quantities import read_quantity
from cellwright.config.parsing.reader import Keys, Read, Reader
from cellwright.config.parsing.schema import accepts
from cellwright.config.parsing.tree import Leaf, YamlNode, describe

MAX_SENTENCE = 500
"""Maximum length of a sentence [characters]."""
FULL = "full"
"""All attainable points."""


@accepts({"type": "string", "minLength": 1, "maxLength": MAX_SENTENCE})
def read_sentence(reader: Reader, node: YamlNode) -> str | None:
    """Return a printable sentence."""
    text = node.value.strip() if isinstance(node, Leaf) and isinstance(node.value, str) else ""
    if 0 < len(text) <= MAX_SENTENCE and text.isprintable():
        return text
    reader.problems.error(
        node, f"must be a sentence of 1 to {MAX_SENTENCE} printable characters (got {describe(node)})"
    )
    return None


@accepts({"anyOf": [{"const": FULL}, {"type": "number", "exclusiveMinimum": 0}]})
def read_points(reader: Reader, node: YamlNode) -> dict[str, float | None] | None:
    """Return points above 0; None for all."""
    match node:
        case Leaf(value=str(text)) if text == FULL:
            return {"points": None}
        case Leaf(value=int() | float() as points) if not isinstance(points, bool) and 0 < points < math.inf:
            return {"points": float(points)}
    reader.problems.error(node, f"must be {FULL} or points above 0 (got {describe(node)})")
    return None


@accepts(schema.mapping(schema.EXPRESSION))
def read_joints(reader: Reader, node: YamlNode) -> dict[str, float] | None:
    """Return joint positions by name; whether there are such joints is checked with the cell."""
    table = reader.table(node)
    read = {entry.name: read_quantity(reader, entry.value) for entry in table.entries.values()} if table else {}
    return {str(name): value for name, value in read.items() if value is not None}


def values_of(keys: Keys) -> Read:
    """Return a reader of the values of a mapping; None if a required one is missing."""

    @accepts(keys.schema)
    def read(reader: Reader, node: YamlNode) -> dict[str, Any] | None:
        table = reader.table(node)
        values = keys.read(table, reader) if table else {}
        return values if table and keys.complete(values) else None

    return read
