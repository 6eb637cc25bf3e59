"""The sections that describe faults: `drops` and `faulty_parts`."""

from __future__ import annotations

from collections.abc import Mapping

from cellwright.config.parsing.figures import DropFigure, Figures
from cellwright.config.parsing.python2 import dictionary_order
from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Entry, Items, Leaf, Node, Table, described, shortened
from cellwright.config.trial.keys import DROP_REGION
from cellwright.config.trial.models import PartBook
from cellwright.config.trial.trial import Options
from cellwright.util.errors import did_you_mean
from cellwright.util.pose import Vector3

_MANY = 20
"""After so many unknown names no similar ones are searched for: that takes long and helps nobody."""


def read_drops(node: Node, book: PartBook) -> tuple[DropFigure, ...]:
    """The regions in the original's order."""
    reader = book.reader
    table = reader.table(node)
    if table is None:
        return ()
    reader.ignored(table, ("drop_regions",))
    regions_node = reader.required(table, "drop_regions")
    regions = reader.table(regions_node) if regions_node else None
    drops: dict[object, DropFigure] = {}
    for entry in reader.entries(regions) if regions else ():
        drop = _region(entry, book)
        if drop:
            drops[entry.name] = drop
    return tuple(drops[name] for name in dictionary_order(drops))


def _region(entry: Entry, book: PartBook) -> DropFigure | None:
    reader = book.reader
    name = reader.key(entry)
    table = reader.table(entry.value)
    if table is None:
        return None
    reader.ignored(table, DROP_REGION.names)
    first_node, second_node, target_node, type_node = (reader.required(table, field) for field in DROP_REGION.required)
    first = _corner(first_node, reader) if first_node else None
    second = _corner(second_node, reader) if second_node else None
    target_table = reader.table(target_node) if target_node else None
    target = reader.placement(target_table) if target_table and reader.required(target_table, "xyz") else None
    part_type = reader.name(type_node) if type_node else None
    if name is None or first is None or second is None or target is None or type_node is None or part_type is None:
        return None
    return DropFigure(name, book.part_type(part_type, type_node), first, second, target)


def _corner(node: Node, reader: Reader) -> Vector3 | None:
    table = reader.table(node)
    if table is None:
        return None
    reader.ignored(table, ("xyz",))
    xyz = reader.required(table, "xyz")
    return reader.position(xyz) if xyz else None


def read_faulty(node: Node, reader: Reader) -> dict[str, Node]:
    """The names in `faulty_parts`, in the original's order, and where each stands."""
    names: dict[str, Node] = {}
    match node:
        case Items():
            for item in node.items:
                if isinstance(item, Leaf) and item.value is None:
                    reader.problems.warn(item, "an empty entry, ignored")
                    continue
                name = reader.name(item)
                if name is not None:
                    names[name] = item
        case Table():
            reader.problems.warn(node, "should be a list of names; the mapping's keys are taken for them")
            for entry in node.entries.values():
                name = reader.key(entry)
                if name is not None:
                    names[name] = Leaf(name, entry.place, entry.key)
        case Leaf(value=str(text)):
            reader.problems.warn(node, f"should be a list of names (- {text}); each letter is taken for one")
            names = dict.fromkeys(text, node)
        case _:
            reader.problems.error(node, f"must be a list of names, not {described(node)}")
    return {str(name): names[str(name)] for name in dictionary_order(dictionary_order(names))}


def check_faulty(faulty: Mapping[str, Node], figures: Figures, options: Options, reader: Reader) -> None:
    """Warn of every name that no part of the cell will bear (of single letters it has been said why)."""
    names = {model.name.rpartition("|")[2] for model in (*figures.models, *figures.extra_models)}
    for part_type in {part.type for part in figures.belt}:
        times = sum(part.type == part_type for part in figures.belt)
        names.update(f"{part_type}_clone_{k}" for k in range(times * options.belt_population_cycles))
    if options.fill_demo_tray and figures.orders:
        first = figures.orders[0].parts
        names.update(f"{part_type}_clone_{k}" for part_type, _ in first for k in range(len(first)))
    known = sorted(names)
    for count, name in enumerate(name for name in faulty if name not in names and len(name) > 1):
        suggestion = did_you_mean(name, known) if count < _MANY else ""
        reader.problems.warn(faulty[name], f"no part is called {shortened(name)!r}{suggestion}")
