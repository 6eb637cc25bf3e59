"""JSON Schema (draft 2020-12) of configuration files: what each reader of a value accepts.

A reader carries the schema of its values, attached by `accepts`, so a table of keys has one of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias, TypeVar

Schema: TypeAlias = dict[str, Any]
Source: TypeAlias = "Schema | Callable[[], Schema]"
"""A schema, or a function that returns it when all tables are there."""

F = TypeVar("F", bound=Callable[..., Any])

DRAFT = "https://json-schema.org/draft/2020-12/schema"
NUMBER_PATTERN = r"^\s*[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?\s*$"
NUMBER: Schema = {"type": ["number", "string"], "pattern": NUMBER_PATTERN}
"""A number; it may stand in quotes."""
EXPRESSION: Schema = {"type": ["number", "string"]}
"""A number or an arithmetic expression, such as `pi/2`."""
NAME: Schema = {"type": ["string", "number"]}
"""A text, or a number, which becomes one."""
ANYTHING: Schema = {}


@dataclass(frozen=True, slots=True)
class Elsewhere:
    """Marker of an entry that its section's own reader reads; it carries the schema alone."""

    source: Source


def accepts(source: Source) -> Callable[[F], F]:
    """Return a decorator that attaches the schema of the values that a reader accepts.

    Example:
        >>> @accepts({"type": "boolean"})
        ... def read(reader, node): ...
        >>> schema_of(read)
        {'type': 'boolean'}
    """

    def attach(read: F) -> F:
        read.__dict__["schema"] = source
        return read

    return attach


def schema_of(read: object) -> Schema:
    """Return the schema of a reader; that of any value if it has none."""
    source = read.source if isinstance(read, Elsewhere) else getattr(read, "schema", ANYTHING)
    return dict(source() if callable(source) else source)


def bounded(schema: Schema, minimum: float, maximum: float) -> Schema:
    """Return the schema of a number within bounds."""
    return {**schema, "minimum": minimum, "maximum": maximum}


def array(items: Schema, minimum: int, maximum: int | None = None) -> Schema:
    """Return the schema of a list with a number of items."""
    bounds = {"minItems": minimum} if maximum is None else {"minItems": minimum, "maxItems": maximum}
    return {"type": "array", "items": items, **bounds}


def mapping(values: Schema) -> Schema:
    """Return the schema of a mapping of any names to values of one kind."""
    return {"type": "object", "additionalProperties": values}


def words(known: Collection[str]) -> Schema:
    """Return the schema of one of several words."""
    return {"enum": list(known)}


def suggested(known: Collection[str]) -> Schema:
    """Return the schema of any name, of which an editor suggests the known ones."""
    return {"anyOf": [{"enum": list(known)}, NAME]}


def table_schema(
    readers: Mapping[str, object], required: Collection[str], descriptions: Mapping[str, str], *, strict: bool
) -> Schema:
    """Return the schema of a mapping with known entries.

    Args:
        readers: the reader of each entry, or None.
        required: names of mandatory entries.
        descriptions: a line of text on entries, by name.
        strict: refuse other entries.
    """
    properties: dict[str, Schema] = {}
    for name, read in readers.items():
        properties[name] = schema_of(read)
        if name in descriptions:
            properties[name]["description"] = descriptions[name]
    schema: Schema = {"type": "object", "properties": properties, "additionalProperties": not strict}
    return {**schema, "required": list(required)} if required else schema
