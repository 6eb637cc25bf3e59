"""Section `parts`: grids of parts in bins, and parts that a belt brings at intervals."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

from cellwright.config.footprints import PART_TYPES, Footprint, footprint
from cellwright.config.layout.keys import ANGLE, COORDINATE
from cellwright.config.layout.layout import Bin
from cellwright.config.layout.reader import Cell
from cellwright.config.parsing import schema
from cellwright.config.parsing.quantities import quantities, quantity
from cellwright.config.parsing.reader import Keys, Reader, whole
from cellwright.config.parsing.tree import Items, Table, YamlNode, describe, shortened, with_on
from cellwright.config.trial.parts import PartRegistry
from cellwright.config.trial.trial import BeltPart, Part
from cellwright.config.trial.values import read_grid
from cellwright.util.errors import suggestion
from cellwright.util.pose import Pose

MIN_INTERVAL = 0.1
"""Minimum time between two parts of an entry on a belt [s]."""
FREE_FALL = 0.006
"""Height over a belt at which parts appear, as in the trials of 2017 [m]."""
BELT_TIME = 500.0
"""Time for which a belt brings parts in a trial without a limit [s]."""
_TOUCH = 1e-6
"""Overlap and overhang that count as touching [m]."""
_MAX_COMPARED = 200
"""Number of parts in a bin up to which all pairs are compared."""
_STEP = quantities((2,), COORDINATE, "[x, y]")
IN_BIN = Keys(
    {"type": Reader.name, "in": Reader.name},
    {"grid": read_grid, "from": _STEP, "step": _STEP, "turn": ANGLE},
    strict="entry",
    texts="parts-in-bins",
)
"""Keys of parts in a bin."""
ON_BELT = Keys(
    {"type": Reader.name, "on": Reader.name, "every": quantity(MIN_INTERVAL, 1e5, "s")},
    {"after": quantity(0.0, 1e5, "s"), "across": COORDINATE, "turn": ANGLE, "count": whole(1, 2000, "parts")},
    strict="entry",
    texts="parts-on-belts",
)
"""Keys of parts on a belt."""


def parts_schema() -> schema.Schema:
    """Return the JSON Schema of the section `parts`."""
    return schema.array({"anyOf": [IN_BIN.schema(), ON_BELT.schema()]}, 0)


@dataclass(slots=True)
class ShortParts:
    """Parts of the section: those in bins, and those that belts bring."""

    in_bins: list[Part] = field(default_factory=list)
    on_belts: list[BeltPart] = field(default_factory=list)


def read_parts(node: YamlNode, registry: PartRegistry, cell: Cell, time_limit: float | None) -> ShortParts:
    """Return the parts of the section `parts`.

    Args:
        node: the section.
        registry: count of the parts.
        cell: the cell with its bins and belts.
        time_limit: end of the trial, up to which a belt brings parts [s]; None for no limit.
    """
    found, reader = ShortParts(), registry.reader
    if not isinstance(node, Items):
        reader.problems.error(node, f"must be a list such as [{{type: gear_part, in: BIN}}] (got {describe(node)})")
        return found
    lying: dict[str, list[Footprint]] = {}
    for item in node.items:
        table = reader.table(item)
        if table is None:
            continue
        table = with_on(table)
        if ("in" in table) == ("on" in table):
            reader.problems.error(table, "write in: BIN or on: BELT, and one of them")
        elif "in" in table:
            found.in_bins += _in_bin(table, registry, cell, lying)
        else:
            found.on_belts += _on_belt(table, registry, cell, BELT_TIME if time_limit is None else time_limit)
    return found


def _in_bin(table: Table, registry: PartRegistry, cell: Cell, lying: dict[str, list[Footprint]]) -> list[Part]:
    """Return a grid of parts in a bin: x is the outer loop, y the inner."""
    reader, values = registry.reader, IN_BIN.read(table, registry.reader)
    place = _named(table, "in", values, cell.layout.bins, cell, reader)
    if place is None or not IN_BIN.complete(values):
        return []
    kind = registry.known_type(values["type"], table.entries["type"].value)
    nx, ny = values.get("grid", (1, 1))
    if kind is None or not registry.admit(table, nx * ny):
        return []
    xs, ys = (_row(place, axis, count, values) for axis, count in enumerate((nx, ny)))
    poses = [Pose.from_rpy((x, y, 0.0), (0.0, 0.0, values.get("turn", 0.0))) for x, y in product(xs, ys)]
    if not _fits(table, kind, place, poses, lying, reader):
        return []
    registry.locations[kind].add(place.name)
    return [Part(f"{place.name}|{kind}_{registry.number(kind)}", kind, place.corner @ pose) for pose in poses]


def _row(place: Bin, axis: int, count: int, values: dict[str, Any]) -> list[float]:
    """Return coordinates along one edge, from the bin's corner; what the file leaves out centres the grid."""
    length = place.size[axis]
    first = values["from"][axis] if "from" in values else None
    step = values["step"][axis] if "step" in values else None
    if first is None:
        # even gaps to the edges, too, if the file has no step
        step = length / (count + 1) if step is None else step
        first = (length - step * (count - 1)) / 2
    elif step is None:
        step = (length - 2 * first) / (count - 1) if count > 1 else 0.0
    return [first + step * k for k in range(count)]


def _fits(
    table: Table, kind: str, place: Bin, poses: Sequence[Pose], lying: dict[str, list[Footprint]], reader: Reader
) -> bool:
    """Return whether parts lie within a bin and beside each other; report it if not."""
    middle = Pose((place.size[0] / 2, place.size[1] / 2, 0.0))
    if kind not in PART_TYPES:
        # of the shape of a part of one's own only the place is known here
        inside = [abs(middle.position[0] - p.position[0]) <= place.size[0] / 2 for p in poses]
        inside += [abs(middle.position[1] - p.position[1]) <= place.size[1] / 2 for p in poses]
        if not all(inside):
            reader.problems.error(table, f"a part would be outside {place.name}; change from, step or grid")
        return all(inside)
    covered = [footprint(kind, pose) for pose in poses]
    margin = min(each.margin(middle, place.size) for each in covered)
    if margin < -_TOUCH:
        message = (
            f"a part would reach over the edge of {place.name} by {-margin * 1000:.0f} mm; change from, step or grid"
        )
        reader.problems.error(table, message)
        return False
    there = lying.setdefault(place.name, [])
    for number, each in enumerate(covered):
        others = [*there, *covered[:number]] if len(there) + len(covered) <= _MAX_COMPARED else covered[:number][-1:]
        overlap = -min((each.gap(other, 0.0) for other in others), default=0.0)
        if overlap > _TOUCH:
            message = (
                f"too many parts for {place.name}: two overlap by {overlap * 1000:.0f} mm; use fewer, or another step"
            )
            reader.problems.error(table, message)
            return False
    there += covered
    return True


def _on_belt(table: Table, registry: PartRegistry, cell: Cell, time_limit: float) -> list[BeltPart]:
    """Return the parts that a belt brings at intervals, as many as appear before the time limit unless it says."""
    reader, values = registry.reader, ON_BELT.read(table, registry.reader)
    belt = _named(table, "on", values, cell.layout.belts, cell, reader)
    if belt is None or not ON_BELT.complete(values):
        return []
    kind = registry.known_type(values["type"], table.entries["type"].value)
    every, after, across = values["every"], values.get("after", 0.0), values.get("across", 0.0)
    count = values.get("count", max(1, math.ceil((time_limit - after) / every)))
    if kind is None or not registry.admit(table, count * registry.options.belt_population_cycles):
        return []
    flat = Pose.from_rpy((0.0, across, 0.0), (0.0, 0.0, values.get("turn", 0.0)))
    margin = (
        footprint(kind, flat).margin(Pose(), (100.0, belt.size[1]))
        if kind in PART_TYPES
        else (belt.size[1] / 2 - abs(across))
    )
    if margin < -_TOUCH:
        reader.problems.error(table, f"the part would reach over the edge of {belt.name} by {-margin * 1000:.0f} mm")
        return []
    height = belt.surface + FREE_FALL - belt.spawn.position[2]
    pose = Pose((0.0, across, height), flat.quaternion)
    registry.locations[kind].add(belt.name)
    return [BeltPart(after + every * k, kind, pose, belt=belt.name) for k in range(count)]


def _named(table: Table, key: str, values: dict[str, Any], known: Sequence[Any], cell: Cell, reader: Reader) -> Any:
    """Return the bin or belt that an entry names; one that was refused has been reported."""
    name = values.get(key)
    found = next((each for each in known if each.name == name), None)
    if found is None and name is not None and name not in cell.refused:
        thing = "bin" if key == "in" else "belt"
        hint = suggestion(name, [each.name for each in known])
        reader.problems.error(table.entries[key].value, f"the cell has no {thing} {shortened(name)!r}{hint}")
    return found
