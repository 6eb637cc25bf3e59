"""Parts of a trial: options and aliases, parts over bins and in frames, belt parts, drop regions and faulty parts."""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from itertools import product

from cellwright.config.footprints import PART_TYPES
from cellwright.config.layout.layout import Layout
from cellwright.config.parsing.coordinates import coordinates
from cellwright.config.parsing.python2 import dictionary_order, quotient
from cellwright.config.parsing.reader import Keys, Placement, Reader, any_name, section
from cellwright.config.parsing.schema import Elsewhere, mapping
from cellwright.config.parsing.tree import Entry, Items, Leaf, Located, Table, YamlNode, describe, shortened
from cellwright.config.trial.other_years import EARLY, LATER_OPTIONS, OtherYear
from cellwright.config.trial.trial import BeltPart, DropRegion, Options, Part, Trial
from cellwright.config.trial.values import read_aliases, read_destination, read_switch
from cellwright.util.errors import did_you_mean, suggestion
from cellwright.util.pose import IDENTITY_QUATERNION, Pose

DEFAULT_ALIASES: Mapping[str, str] = {"belt_model_type1": "part1", "belt_model_type2": "part2"}
"""Default aliases of part types, unless a file has its own."""

ALIASES = "model_type_aliases"
_SWITCHES = [each.name for each in fields(Options) if isinstance(each.default, bool)]
MAX_PARTS = 2000
"""Maximum number of parts in one cell, including those on the belt's pool."""
_MAX_SEARCHED = 100
"""Number of names above which the search for similar ones stops: it takes long and is no help by then."""
TYPE = any_name(sorted(PART_TYPES))
PART = Keys({"type": TYPE, "pose": Reader.placement}, texts="extras")
GRID = Keys(
    {
        "xyz_start": coordinates(3),
        "xyz_end": coordinates(2),
        "rpy": Reader.vector,
        "num_models_x": Reader.whole,
        "num_models_y": Reader.whole,
    },
    texts="grids",
)
BIN = Keys({"models": Elsewhere(lambda: mapping(GRID.schema()))}, {"xyz": Reader.position}, texts="bins")
BELT_PART = Keys({"pose": Reader.placement})
EXTRAS = Keys({"models": Elsewhere(lambda: mapping(PART.schema()))})
_BY_TYPE = "belt parts are listed by type and then by time [s], as in gear_part: {1.0: {pose: {…}}}"
_NO_POSE = "; files without one are of the 2016 format"
_MAX_SUGGESTED = 20
"""Number of unknown names after which the search for similar ones stops: it takes long and is no help by then."""
_CORNER = section(Keys({"xyz": Reader.position}), lambda xyz: xyz)
OPTIONS = Keys(
    optional={**dict.fromkeys(_SWITCHES, read_switch), "belt_population_cycles": Reader.whole, ALIASES: read_aliases},
    texts="options",
)
DROP_REGION = Keys(
    {"min": _CORNER, "max": _CORNER, "destination": read_destination, "part_type_to_drop": TYPE}, texts="drop-regions"
)
DROPS = Keys({"drop_regions": Elsewhere(lambda: mapping(DROP_REGION.schema()))})


def read_options(node: YamlNode, reader: Reader) -> tuple[Options, Mapping[str, str]]:
    """Return the section `options`, and the aliases of part types in it."""
    table = reader.table(node)
    if table is None:
        return Options(), DEFAULT_ALIASES
    for entry in table.entries.values():
        if entry.name not in OPTIONS.names:
            year = LATER_OPTIONS.get(entry.name)
            origin = f" (new in the {year} format)" if year else ""
            hint = did_you_mean(str(entry.name), OPTIONS.names)
            reader.problems.warn(entry, f"unknown option, ignored{origin}{hint}", ignored=entry)
    values = OPTIONS.values(table, reader)
    aliases = values.pop(ALIASES, DEFAULT_ALIASES)
    return Options(**values), aliases


@dataclass(slots=True)
class PartRegistry:
    """Count of the parts while they are read: the numbers in their names, their total, and their locations.

    Numbers are counted per type as written: an alias counts apart from its type. An alias of an alias is not followed.
    `types` are the part types that have a model, `layout` that of the cell; `locations` are the places of each type.
    """

    reader: Reader
    options: Options
    aliases: Mapping[str, str]
    types: frozenset[str]
    layout: Layout
    count: int = 0
    locations: defaultdict[str, set[str]] = field(default_factory=lambda: defaultdict(set))
    _numbers: defaultdict[str, int] = field(default_factory=lambda: defaultdict(int))

    def number(self, counted_as: str) -> int:
        """Return the next number, from 1."""
        self._numbers[counted_as] += 1
        return self._numbers[counted_as]

    def admit(self, where: Located, more: int) -> bool:
        """Return whether `more` parts still fit the bounds; report them if not."""
        self.count += more
        if self.count <= MAX_PARTS:
            return True
        self.reader.problems.error(where, f"more than {MAX_PARTS} parts in the cell")
        self.count -= more
        return False

    def part_type(self, name: str, where: Located, part: Located) -> str:
        """Return the type of a name, with a warning if no part of that type exists, so that `part` is left out."""
        resolved = self.aliases.get(name, name)
        if resolved not in self.types:
            aliases = self.aliases if len(self.aliases) <= _MAX_SEARCHED else ()
            hint = did_you_mean(name, [*self.types, *aliases]) or f" (known: {', '.join(sorted(self.types))})"
            message = f"unknown part type {shortened(resolved)!r}, left out of the cell{hint}"
            self.reader.problems.warn(where, message, ignored=part)
        return resolved

    def known_type(self, name: str, where: Located) -> str | None:
        """Return the type of a name in a section of Cellwright's own, which refuses unknown types."""
        resolved = self.aliases.get(name, name)
        if resolved in self.types:
            return resolved
        self.reader.problems.error(where, f"unknown part type {shortened(resolved)!r}{suggestion(name, self.types)}")
        return None


def read_bins(node: YamlNode, registry: PartRegistry) -> tuple[Part, ...]:
    """Return the section `models_over_bins`: grids of parts, numbered in the original's order."""
    reader = registry.reader
    found: dict[str, Part] = {}
    for _, name, table in reader.tables(node):
        origin = _origin(name, table, registry)
        models = table.get("models")
        if models is None or (isinstance(models, Leaf) and models.value is None):
            continue
        for model in reader.entries(models):
            parts = _grid(name, origin, model, registry)
            lost = [part.name for part in parts if part.name in found]
            # as in the original, a part replaces an earlier one of the same name
            if lost:
                first = lost[0] if len(lost) == 1 else f"{lost[0]} to {lost[-1]}"
                message = (
                    f"{first} exists twice, since aliases and types are numbered apart; only the later one is kept"
                )
                reader.problems.warn(model, message)
            found.update((part.name, part) for part in parts)
    return tuple(found.values())


def read_extras(node: YamlNode, registry: PartRegistry) -> tuple[Part, ...]:
    """Return the section `models_to_spawn`: single parts, each in the frame of a link."""
    reader, frames = registry.reader, registry.layout.reference_frames
    found: dict[str, Part] = {}
    for entry, frame, frame_table in reader.tables(node):
        reader.ignored(frame_table, EXTRAS.names)
        if frame not in frames:
            message = f"unknown reference frame, its parts are left out{suggestion(frame, frames)}"
            reader.problems.warn(entry, message, ignored=entry)
        models = reader.required(frame_table, "models")
        for model in reader.entries(models) if models else ():
            table = reader.table(model.value)
            part = read_part(table, registry) if table else None
            if part and registry.admit(model, 1):
                part_type, placement = part
                name = f"{frame.replace('::', '|')}|{part_type}_{registry.number(part_type)}"
                found[name] = Part(name, part_type, placement.pose, frame, placement)
    return tuple(found.values())


def read_part(table: Table, registry: PartRegistry) -> tuple[str, Placement] | None:
    """Return type and placement of a single part of `models_to_spawn` or an order."""
    values = PART.read(table, registry.reader)
    if not PART.complete(values):
        return None
    return registry.part_type(values["type"], table.entries["type"].value, table), values["pose"]


def _origin(name: str, table: Table, registry: PartRegistry) -> Pose | None:
    """Return the frame of a bin's grids: at a place as written, else the bin's corner, along the bin's edges."""
    reader = registry.reader
    values = BIN.read(table, reader)
    if "xyz" in table:
        xyz = values.get("xyz")
        return None if xyz is None else Pose(xyz)
    bins = {each.name: each for each in registry.layout.bins}
    if name in bins:
        return bins[name].corner
    hint = f"; only bins have a default{did_you_mean(name, bins)}"
    reader.required(table, "xyz", hint)
    return None


def _grid(bin_name: str, origin: Pose | None, entry: Entry, registry: PartRegistry) -> list[Part]:
    """Return the grid of parts of one type: x is the outer loop, y the inner, all at the first one's height."""
    reader = registry.reader
    written_type = reader.text_key(entry)
    table = reader.table(entry.value)
    if table is None:
        return []
    values = GRID.read(table, reader)
    if written_type is None or origin is None or not GRID.complete(values):
        return []
    start, end, rpy, nx, ny = (values[name] for name in GRID.names)
    if not registry.admit(entry, nx * ny):
        return []
    part_type = registry.part_type(written_type, entry, entry)
    if nx * ny == 0:
        return []
    registry.locations[part_type].add(bin_name)
    step_x = quotient(end[0] - start[0], max(1, nx - 1))
    step_y = quotient(end[1] - start[1], max(1, ny - 1))
    left, front, low = origin.position
    # the original adds coordinates, which turning would round; so a bin along the axes is not turned
    turn = None if origin.quaternion == IDENTITY_QUATERNION else origin @ Pose((-left, -front, -low))
    parts: list[Part] = []
    for ix, iy in product(range(nx), range(ny)):
        x = left + start[0] + ix * step_x
        y = front + start[1] + iy * step_y
        name = f"{bin_name}|{part_type}_{registry.number(written_type)}"
        placement = Placement((x, y, low + start[2]), rpy)
        pose = placement.pose if turn is None else turn @ placement.pose
        parts.append(Part(name, part_type, pose, written=placement))
    return parts


def read_belt(node: YamlNode, registry: PartRegistry, other_year: OtherYear) -> tuple[BeltPart, ...]:
    """Return the parts in the order of their times, ties in the original's order."""
    reader = registry.reader
    found: dict[tuple[str, object], BeltPart] = {}
    for entry in reader.entries(node):
        if isinstance(entry.value, Table) and "type" in entry.value.entries:
            reader.problems.error(entry, f"{_BY_TYPE}; this entry{other_year.format_hint(EARLY)}")
            continue
        written_type = reader.key(entry)
        times = reader.entries(entry.value)
        if written_type is None or not isinstance(entry.value, Table):
            continue
        part_type = registry.part_type(written_type, entry, entry)
        for time in times:
            part = _belt_part(part_type, time, reader)
            if part is None:
                continue
            if (part_type, time.name) in found:
                reader.problems.warn(time, f"duplicate time for {part_type}; only this part is kept")
            found[part_type, time.name] = part
            registry.locations[part_type].add("belt")
    if not registry.admit(node, len(found) * registry.options.belt_population_cycles):
        return ()
    return tuple(sorted(found.values(), key=lambda part: part.time))


def _belt_part(part_type: str, entry: Entry, reader: Reader) -> BeltPart | None:
    if entry.name == "pose":
        reader.problems.error(entry, f"must be a time [s] with the pose below it{_NO_POSE}")
        return None
    time = reader.number(Leaf(entry.name, entry.place, entry.key))
    if time is None:
        return None
    if isinstance(entry.value, Leaf) and entry.value.value is None:
        reader.problems.error(entry, f"the required entry 'pose' is missing{_NO_POSE}")
        return None
    table = reader.table(entry.value)
    if table is None:
        return None
    reader.ignored(table, BELT_PART.names)
    pose = reader.required(table, "pose")
    placement = reader.placement(pose) if pose else None
    if placement is None:
        return None
    if time < 0:
        reader.problems.warn(entry, f"must not be negative (got {time:g}); the part appears at once")
    return BeltPart(float(time), part_type, placement.pose, placement)


def read_drops(node: YamlNode, registry: PartRegistry) -> tuple[DropRegion, ...]:
    """Return the regions in the original's order."""
    reader = registry.reader
    table = reader.table(node)
    if table is None:
        return ()
    reader.ignored(table, DROPS.names)
    regions_node = reader.required(table, "drop_regions")
    drops: dict[object, DropRegion] = {}
    for entry in reader.entries(regions_node) if regions_node else ():
        drop = _region(entry, registry)
        if drop:
            drops[entry.name] = drop
    return tuple(drops[name] for name in dictionary_order(drops))


def _region(entry: Entry, registry: PartRegistry) -> DropRegion | None:
    reader = registry.reader
    name = reader.key(entry)
    table = reader.table(entry.value)
    if table is None:
        return None
    values = DROP_REGION.read(table, reader)
    if name is None or not DROP_REGION.complete(values):
        return None
    part_type = registry.part_type(values["part_type_to_drop"], table.entries["part_type_to_drop"].value, table)
    first, second, destination = values["min"], values["max"], values["destination"]
    lower, upper = (tuple(map(choose, first, second)) for choose in (min, max))
    return DropRegion(name, part_type, lower, upper, destination.pose, (first, second, destination))


def read_faulty(node: YamlNode, reader: Reader) -> dict[str, YamlNode]:
    """Return the names in `faulty_parts`, in the original's order, each with its node."""
    names: dict[str, YamlNode] = {}
    match node:
        case Items():
            for item in node.items:
                if isinstance(item, Leaf) and item.value is None:
                    reader.problems.warn(item, "empty entry, ignored")
                    continue
                name = reader.name(item)
                if name is not None:
                    names[name] = item
        case Table():
            reader.problems.warn(node, "should be a list of names (got a mapping); its keys are used")
            for entry in node.entries.values():
                name = reader.key(entry)
                if name is not None:
                    names[name] = Leaf(name, entry.place, entry.key)
        case Leaf(value=str(text)):
            example = f"such as [{shortened(text)}] (got {describe(node)})"
            reader.problems.warn(node, f"should be a list of names, {example}; each letter counts as a name")
            names = dict.fromkeys(text, node)
        case _:
            reader.problems.error(node, f"must be a list of names (got {describe(node)})")
    return {name: names[name] for name in dictionary_order(dictionary_order(names))}


def check_faulty(faulty: Mapping[str, YamlNode], trial: Trial, reader: Reader) -> None:
    """Warn of each name that no part of the cell will have; single letters already have a warning."""
    names = {part.name.rpartition("|")[2] for part in (*trial.bin_parts, *trial.extra_parts)}
    names |= dict(trial.belt_clones()).keys() | dict(trial.demo_clones()).keys()
    known = sorted(names)
    for count, name in enumerate(name for name in faulty if name not in names and len(name) > 1):
        hint = did_you_mean(name, known) if count < _MAX_SUGGESTED else ""
        reader.problems.warn(faulty[name], f"no part is called {shortened(name)!r}{hint}")
