"""Base of a cell: the entries of another cell, which its own change, add to and take away from."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path

from cellwright._package import FOLDER
from cellwright.config.parsing.expressions import check_expressions
from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.sources import JoinedText, Text, read_texts
from cellwright.config.parsing.tree import Entry, Leaf, Problem, Problems, Table, YamlNode, describe, shortened
from cellwright.config.parsing.yaml_source import parse_mapping, parse_packaged
from cellwright.util.errors import DescriptionError, did_you_mean, suggestion

BASED_ON = "based_on"
CELL = "cell"
"""Name of the section that describes a cell."""
EMPTY = "empty"
GEAR2017 = "gear2017"
BASES = (EMPTY, GEAR2017)
"""Cells that come with Cellwright, beside files."""
MAX_BASES = 10
"""Maximum number of cells that are based on one another."""
SECTIONS = ("bins", "belts", "carriers", "trays", "arms", "robots", "structure", "places", "views", "sensors")
"""Sections whose entries are named by the file, and changed one by one."""
PACKAGED = "<gear2017>"
"""Place of the entries of the packaged cell, in messages."""

_DEPENDENT: Mapping[str, tuple[tuple[frozenset[str], frozenset[str]], ...]] = {
    "belts": (
        (frozenset({"from", "to"}), frozenset({"at", "turn", "length"})),
        (frozenset({"at", "length"}), frozenset({"from", "to"})),
        (frozenset({"from", "to", "at", "turn", "length"}), frozenset({"spawn", "frame", "wall"})),
        (frozenset({"ends"}), frozenset({"wall"})),
        (frozenset({"wall"}), frozenset({"ends"})),
    ),
    "carriers": (
        (frozenset({"at", "turn"}), frozenset({"path", "tray_frame", "quality_sensor"})),
        (frozenset({"tray"}), frozenset({"tray_frame", "quality_sensor"})),
    ),
}
"""Keys whose change makes the base's values of others meaningless: such as places that go with what is moved."""


_VIEWS = "views"
_SEEN = ("bins", "belts", "carriers", "trays", "arms", "robots")
"""Sections with things that views look at."""


def with_base(own: Table, reader: Reader, files: tuple[Path, ...] = ()) -> Table | None:
    """Return the section `cell` together with what it is based on; None if that was refused.

    The base's entries come first, in its order: bodies are made in this order.
    """
    node = own.get(BASED_ON)
    base = Table(own.place, own.key) if node is None else _base(node, reader, files)
    return None if base is None else _merged(base, own, reader)


@cache
def gear2017_section() -> Table:
    """Return the section `cell` of the 2017 cell, as it is packaged."""
    file = Path(FOLDER) / "config" / "layout" / "gear2017.yaml"
    text = JoinedText([Text(PACKAGED, file.read_text(encoding="utf-8"))])
    section = parse_packaged(text).get(CELL)
    assert isinstance(section, Table)
    return section


def _base(node: YamlNode, reader: Reader, files: tuple[Path, ...]) -> Table | None:
    name = node.value if isinstance(node, Leaf) else None
    if name == EMPTY:
        return Table(node.place, node.key)
    if name == GEAR2017:
        return gear2017_section()
    if not isinstance(name, str) or not name.isprintable():
        reader.problems.error(node, f"must be {', '.join(BASES)} or the path of a file (got {describe(node)})")
        return None
    if not name.endswith((".yaml", ".yml")):
        hint = suggestion(name, BASES)
        reader.problems.error(node, f"unknown cell {shortened(name)!r}, and no path of a .yaml file{hint}")
        return None
    return _from_file(Path(node.place.path).parent / name, node, reader, files)


def _from_file(path: Path, node: YamlNode, reader: Reader, files: tuple[Path, ...]) -> Table | None:
    """Return the section `cell` of a file, with what it is itself based on."""
    if path.resolve() in files:
        reader.problems.error(node, f"{path} is based on itself; name another cell")
        return None
    if len(files) >= MAX_BASES:
        reader.problems.error(node, f"more than {MAX_BASES} cells are based on one another")
        return None
    problems = Problems()
    try:
        root = parse_mapping(read_texts([path]), problems, "a cell must be a mapping with a section cell")
    except DescriptionError as error:
        for problem in error.problems:
            message = problem.message if isinstance(problem, Problem) else str(problem)
            place = str(problem.place) if isinstance(problem, Problem) else str(path)
            reader.problems.error(node, f"{place}: {message}")
        return None
    section = root.get(CELL)
    if not isinstance(section, Table):
        reader.problems.error(node, f"{path} has no section {CELL}")
        return None
    check_expressions(section, reader.problems)
    return with_base(section, reader, (*files, path.resolve()))


def _merged(base: Table, own: Table, reader: Reader) -> Table:
    base = _without_stale_views(base, own)
    merged = Table(own.place, own.key, dict(base.entries))
    for name, entry in own.entries.items():
        below = base.get(name) if isinstance(name, str) else None
        if name == BASED_ON:
            continue
        if not isinstance(entry.value, Table):
            merged.entries[name] = entry
        elif name in SECTIONS:
            known = below if isinstance(below, Table) else Table(entry.place, entry.key)
            merged.entries[name] = _replaced(entry, _section(known, entry.value, str(name), reader))
        elif isinstance(below, Table):
            merged.entries[name] = _replaced(entry, _changed(below, entry.value, "", reader))
        else:
            merged.entries[name] = entry
    return merged


def _without_stale_views(base: Table, own: Table) -> Table:
    """Return the base without its views of things that its own cell changes: these are computed."""
    entry = base.entries.get(_VIEWS)
    changed = {name: section for name in _SEEN if isinstance(section := own.get(name), Table)}
    if entry is None or not isinstance(entry.value, Table) or not changed:
        return base
    stale: set[object] = {"overview", *(["bins"] if "bins" in changed else [])}
    for name, section in changed.items():
        below = base.get(name)
        stale |= section.entries.keys() or (below.entries.keys() if isinstance(below, Table) else set())
    kept = {view: each for view, each in entry.value.entries.items() if view not in stale}
    views = Table(entry.value.place, entry.value.key, kept)
    return Table(base.place, base.key, {**base.entries, _VIEWS: _replaced(entry, views)})


def _replaced(entry: Entry, value: Table) -> Entry:
    return Entry(entry.name, value, entry.place, entry.key)


def _section(base: Table, own: Table, name: str, reader: Reader) -> Table:
    """Return a section of named entries; an empty one takes away all of the base's."""
    merged = Table(own.place, own.key, dict(base.entries) if own.entries else {})
    for key, entry in own.entries.items():
        below = merged.entries.get(key)
        if isinstance(entry.value, Leaf) and entry.value.value is None:
            _take_away(merged, entry, reader)
        elif isinstance(entry.value, Table) and below and isinstance(below.value, Table):
            merged.entries[key] = _replaced(entry, _changed(below.value, entry.value, name, reader))
        elif isinstance(entry.value, Table):
            merged.entries[key] = _replaced(entry, _changed(Table(entry.place, entry.key), entry.value, "", reader))
        else:
            merged.entries[key] = entry
    return merged


def _changed(base: Table, own: Table, section: str, reader: Reader) -> Table:
    """Return the base's entry with the values that the own one has; an empty value takes the base's away."""
    merged = Table(own.place, own.key, dict(base.entries))
    for changes, without in _DEPENDENT.get(section, ()):
        if changes & own.entries.keys():
            for key in without:
                merged.entries.pop(key, None)
    for name, entry in own.entries.items():
        if isinstance(entry.value, Leaf) and entry.value.value is None:
            if name in base.entries:
                merged.entries.pop(name, None)
            else:
                _take_away(merged, entry, reader)
        else:
            merged.entries[name] = entry
    return merged


def _take_away(merged: Table, entry: Entry, reader: Reader) -> None:
    if merged.entries.pop(entry.name, None) is None:
        hint = did_you_mean(str(entry.name), [str(name) for name in merged.entries])
        message = f"the base has no {shortened(str(entry.name))!r} to take away{hint or '; write a value'}"
        reader.problems.error(entry, message)
