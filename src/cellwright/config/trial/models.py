"""The sections that put parts into the cell from the beginning: `models_over_bins` and `models_to_spawn`."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field

from cellwright.config.layout import BIN_CENTRES, BIN_PART_HEIGHT, BIN_WIDTH, PART_TYPES, REFERENCE_FRAMES
from cellwright.config.parsing.figures import ModelFigure, Placement
from cellwright.config.parsing.problems import Located
from cellwright.config.parsing.python2 import quotient
from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Entry, Leaf, Node, Table, shortened
from cellwright.config.trial.keys import BIN, GRID, PART
from cellwright.config.trial.options import OptionFigures
from cellwright.util.errors import did_you_mean
from cellwright.util.pose import Vector3

MAX_PARTS = 2000
"""Most parts in one cell, those on the belt's pool included."""

_MANY = 100
"""Above so many, names are no longer searched for similar ones: that takes long and helps nobody."""


@dataclass(slots=True)
class PartBook:
    """Keeps count while parts are read: the numbers in their names, and how many there are in all.

    Numbers are counted per type as written: an alias counts apart from the type that it stands for. `types` are the
    part types that there is a model for.
    """

    reader: Reader
    options: OptionFigures
    types: frozenset[str] = PART_TYPES
    count: int = 0
    _numbers: defaultdict[str, int] = field(default_factory=lambda: defaultdict(int))

    def number(self, counted_as: str) -> int:
        """The next number, from 1."""
        self._numbers[counted_as] += 1
        return self._numbers[counted_as]

    def admit(self, where: Located, more: int) -> bool:
        """Whether so many more parts still fit the bounds; reported when not."""
        self.count += more
        if self.count <= MAX_PARTS:
            return True
        self.reader.problems.error(where, f"more than {MAX_PARTS} parts in the cell")
        self.count -= more
        return False

    def part_type(self, name: str, where: Located) -> str:
        """The type that a name stands for, with a warning when no part of that type exists."""
        resolved = self.options.resolve(name)
        if resolved not in self.types:
            aliases = self.options.aliases if len(self.options.aliases) <= _MANY else ()
            known = [*self.types, *aliases]
            suggestion = did_you_mean(name, known) or f" (known: {', '.join(sorted(self.types))})"
            message = f"unknown part type {shortened(resolved)!r}, left out of the cell{suggestion}"
            self.reader.problems.warn(where, message)
        return resolved


def read_bins(node: Node, book: PartBook) -> tuple[ModelFigure, ...]:
    """The section `models_over_bins`: grids of parts, numbered in the original's order."""
    reader = book.reader
    table = reader.table(node)
    found: dict[str, ModelFigure] = {}
    for entry in reader.entries(table) if table else ():
        name = reader.text_key(entry)
        bin_table = reader.table(entry.value)
        if name is None or bin_table is None:
            continue
        reader.ignored(bin_table, BIN.names)
        origin = _origin(name, bin_table, reader)
        models = reader.required(bin_table, "models")
        if models is None or (isinstance(models, Leaf) and models.value is None):
            continue
        model_table = reader.table(models)
        for model in reader.entries(model_table) if model_table else ():
            _add(found, _grid(name, origin, model, book), model, reader)
    return tuple(found.values())


def read_extras(node: Node, book: PartBook) -> tuple[ModelFigure, ...]:
    """The section `models_to_spawn`: single parts, each in the frame of a link."""
    reader = book.reader
    table = reader.table(node)
    found: dict[str, ModelFigure] = {}
    for entry in reader.entries(table) if table else ():
        frame = reader.text_key(entry)
        frame_table = reader.table(entry.value)
        if frame is None or frame_table is None:
            continue
        reader.ignored(frame_table, ("models",))
        if frame not in REFERENCE_FRAMES:
            known = f" (known: {', '.join(REFERENCE_FRAMES)})"
            suggestion = did_you_mean(frame, REFERENCE_FRAMES) or known
            reader.problems.warn(entry, f"unknown reference frame, its parts are left out{suggestion}")
        models = reader.required(frame_table, "models")
        model_table = reader.table(models) if models else None
        for model in reader.entries(model_table) if model_table else ():
            part = _single(frame, model, book)
            if part:
                found[part.name] = part
    return tuple(found.values())


def read_part(table: Table, book: PartBook) -> tuple[str, Placement] | None:
    """A single part, as extras and orders have it: its type and where it belongs."""
    reader = book.reader
    reader.ignored(table, PART.names)
    type_node, pose_node = reader.required(table, "type"), reader.required(table, "pose")
    name = reader.name(type_node) if type_node else None
    placement = reader.placement(pose_node) if pose_node else None
    if type_node is None or name is None or placement is None:
        return None
    return book.part_type(name, type_node), placement


def _origin(name: str, table: Table, reader: Reader) -> Vector3 | None:
    """Where the grids of a bin begin [m]: as written, else at the bin's corner."""
    written = table.get("xyz")
    if written is not None:
        return reader.position(written)
    if name in BIN_CENTRES:
        x, y = BIN_CENTRES[name]
        return (x - BIN_WIDTH / 2, y - BIN_WIDTH / 2, BIN_PART_HEIGHT)
    hint = f"; it is needed for a place that is none of the bins{did_you_mean(name, BIN_CENTRES)}"
    reader.required(table, "xyz", hint)
    return None


def _grid(bin_name: str, origin: Vector3 | None, entry: Entry, book: PartBook) -> list[ModelFigure]:
    """The grid of parts of one type: x is the outer loop, y the inner, all at the first one's height."""
    reader = book.reader
    written_type = reader.text_key(entry)
    table = reader.table(entry.value)
    if table is None:
        return []
    reader.ignored(table, GRID.names)
    nodes = [reader.required(table, name) for name in GRID.required]
    start = reader.coordinates(nodes[0], 3) if nodes[0] else None
    end = reader.coordinates(nodes[1], 2) if nodes[1] else None
    rpy = reader.vector(nodes[2]) if nodes[2] else None
    nx = reader.whole(nodes[3]) if nodes[3] else None
    ny = reader.whole(nodes[4]) if nodes[4] else None
    if written_type is None or origin is None or start is None or end is None or rpy is None:
        return []
    if nx is None or ny is None or not book.admit(entry, nx * ny):
        return []
    part_type = book.part_type(written_type, entry)
    if nx * ny == 0:
        return []
    step_x = quotient(end[0] - start[0], max(1, nx - 1))
    step_y = quotient(end[1] - start[1], max(1, ny - 1))
    parts: list[ModelFigure] = []
    for ix in range(nx):
        for iy in range(ny):
            x = origin[0] + start[0] + ix * step_x
            y = origin[1] + start[1] + iy * step_y
            name = f"{bin_name}|{part_type}_{book.number(written_type)}"
            parts.append(ModelFigure(name, part_type, bin_name, Placement((x, y, origin[2] + start[2]), rpy)))
    return parts


def _add(found: dict[str, ModelFigure], parts: list[ModelFigure], entry: Entry, reader: Reader) -> None:
    """Take parts in; one with the name of an earlier one replaces it, as in the original."""
    lost = [part.name for part in parts if part.name in found]
    if lost:
        first = lost[0] if len(lost) == 1 else f"{lost[0]} to {lost[-1]}"
        message = f"an alias counts apart from its type, so {first} exists twice and only the later one is kept"
        reader.problems.warn(entry, message)
    found.update((part.name, part) for part in parts)


def _single(frame: str, entry: Entry, book: PartBook) -> ModelFigure | None:
    table = book.reader.table(entry.value)
    part = read_part(table, book) if table else None
    if part is None or not book.admit(entry, 1):
        return None
    part_type, placement = part
    name = f"{frame.replace('::', '|')}|{part_type}_{book.number(part_type)}"
    return ModelFigure(name, part_type, frame, placement)
