"""Readers of single values of a layout, for the tables of its keys."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, get_args

from cellwright.config.layout.layout import Colour, KeyFrames, Side
from cellwright.config.layout.surroundings import Block, FloorLine
from cellwright.config.parsing import schema
from cellwright.config.parsing.quantities import quantities, quantity
from cellwright.config.parsing.reader import Keys, Read, Reader, section
from cellwright.config.parsing.schema import Schema, accepts
from cellwright.config.parsing.tree import Entry, Items, Leaf, Table, YamlNode, describe
from cellwright.util.pose import Pose, Vector3

MAX_FRAMES = 100
"""Maximum number of key frames of one way of a carrier."""
MIN_INTERVAL = 0.1
"""Minimum time between two key frames of a carrier [s]."""
MAX_ENTRIES = 100
"""Maximum number of entries in each section of a cell."""
KEY_FRAME = quantities((3,), quantity(-100.0, 100.0, "s or m"), "[time, x, y]")
SIDES: tuple[str, ...] = get_args(Side)
_COLOUR = re.compile(r"#([0-9a-fA-F]{2})([0-9a-fA-F]{2})([0-9a-fA-F]{2})")


@dataclass(frozen=True, slots=True)
class Named:
    """Named entry of a section: its name, where it is written, and its values by key."""

    name: str
    entry: Entry
    table: Table
    values: dict[str, Any]


def section_of(keys: Keys) -> Read:
    """Return a reader of a mapping of names to mappings with these keys; entries with an error are left out."""

    @accepts(lambda: schema.mapping(changed_schema(keys)))
    def read(reader: Reader, node: YamlNode) -> tuple[Named, ...] | None:
        table = reader.table(node)
        if table is None:
            return None
        if len(table.entries) > MAX_ENTRIES:
            reader.problems.error(table, f"too many entries (got {len(table.entries)}, at most {MAX_ENTRIES})")
            return None
        found = []
        for entry in table.entries.values():
            name, body = reader.text_key(entry), reader.table(entry.value)
            values = keys.read(body, reader) if body else {}
            if name is not None and body and keys.complete(values):
                found.append(Named(name, entry, body, values))
        return tuple(found)

    return read


def list_of(keys: Keys, make: Callable[..., Any], maximum: int) -> Read:
    """Return a reader of a list of mappings with these keys, from whose values `make` makes the items."""
    item = section(keys, make)

    @accepts(lambda: schema.array(keys.schema(), 0, maximum))
    def read(reader: Reader, node: YamlNode) -> tuple[Any, ...] | None:
        if not isinstance(node, Items) or len(node.items) > maximum:
            found = f"a list of {len(node.items)}" if isinstance(node, Items) else describe(node)
            reader.problems.error(node, f"must be a list of at most {maximum} mappings (got {found})")
            return None
        found_items = [item(reader, each) for each in node.items]
        return None if None in found_items else tuple(found_items)

    return read


def on_floor(place: Read) -> Read:
    """Return a reader of a pose on the floor without a turn, given as a place."""

    @accepts(schema.schema_of(place))
    def read(reader: Reader, node: YamlNode) -> Pose | None:
        at = place(reader, node)
        return None if at is None else placed(at)

    return read


def block(at: Vector3, size: Vector3, turn: float = 0.0) -> Block:
    """Return a box of a structure."""
    return Block(turned(at, turn), size)


def floor_line(at: tuple[float, float], size: tuple[float, float], turn: float = 0.0) -> FloorLine:
    """Return a line on the floor."""
    return FloorLine(placed(at, turn), size)


def turned(at: Vector3, turn: float = 0.0) -> Pose:
    """Return a pose with a yaw."""
    return Pose.from_rpy(at, (0.0, 0.0, turn))


def placed(at: tuple[float, float], turn: float = 0.0) -> Pose:
    """Return a pose on the floor with a yaw."""
    return turned((*at, 0.0), turn)


@accepts(schema.array(schema.schema_of(KEY_FRAME), 2, MAX_FRAMES))
def read_way(reader: Reader, node: YamlNode) -> KeyFrames | None:
    """Return the key frames of one way of a carrier, whose times ascend from 0."""
    if not isinstance(node, Items) or not 2 <= len(node.items) <= MAX_FRAMES:
        found = f"a list of {len(node.items)}" if isinstance(node, Items) else describe(node)
        reader.problems.error(node, f"must be a list of 2 to {MAX_FRAMES} key frames [time, x, y] (got {found})")
        return None
    frames = [KEY_FRAME(reader, item) for item in node.items]
    if None in frames:
        return None
    times = [frame[0] for frame in frames]
    if times[0] != 0.0 or any(late - early < MIN_INTERVAL for early, late in pairwise(times)):
        message = f"times must ascend from 0 by at least {MIN_INTERVAL:g} s (got {', '.join(f'{t:g}' for t in times)})"
        reader.problems.error(node, message)
        return None
    return tuple((_decimal(time), x, y) for time, x, y in frames)


@accepts({**schema.array(schema.words(SIDES), 0), "uniqueItems": True})
def read_sides(reader: Reader, node: YamlNode) -> tuple[str, ...] | None:
    """Return sides of a floor plan, each once."""
    items = node.items if isinstance(node, Items) else ()
    sides = tuple(str(item.value) for item in items if isinstance(item, Leaf) and item.value in SIDES)
    if isinstance(node, Items) and len(set(sides)) == len(items):
        return sides
    reader.problems.error(node, f"must be a list of {', '.join(SIDES)} (got {describe(node)}); such as [+x, -x]")
    return None


@accepts({"type": "string", "pattern": "^#[0-9a-fA-F]{6}$"})
def read_colour(reader: Reader, node: YamlNode) -> Colour | None:
    """Return a colour from a text such as `#e0762b`."""
    found = _COLOUR.fullmatch(node.value) if isinstance(node, Leaf) and isinstance(node.value, str) else None
    if found is None:
        reader.problems.error(node, f"must be a colour in quotes such as '#e0762b' (got {describe(node)})")
        return None
    red, green, blue = (int(pair, 16) / 255 for pair in found.groups())
    return (red, green, blue, 1.0)


def _decimal(time: float) -> str:
    return repr(time).removesuffix(".0")


def changed_schema(keys: Keys) -> Schema:
    """Return the schema of an entry that may change one of a base: nothing is required, and null takes away."""
    entry = {key: value for key, value in keys.schema().items() if key != "required"}
    null = {"type": "null"}
    values = {
        name: {"anyOf": [{k: v for k, v in value.items() if k != "description"}, null], "description": text}
        if (text := value.get("description")) and name not in keys.required
        else value
        for name, value in entry["properties"].items()
    }
    return {**entry, "type": ["object", "null"], "properties": values}
