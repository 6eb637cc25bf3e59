"""Orders in short: a list of parts with `xy` and `yaw`, or a list of kits, and the tray that they are for."""

from collections.abc import Sequence
from typing import Any

from cellwright.config.footprints import PART_TYPES, footprint
from cellwright.config.layout.keys import ANGLE, COORDINATE
from cellwright.config.layout.layout import Station
from cellwright.config.parsing.quantities import quantities, quantity
from cellwright.config.parsing.reader import Keys, Placement, Reader
from cellwright.config.parsing.schema import Elsewhere, array
from cellwright.config.parsing.tree import Items, Table, YamlNode, describe, shortened
from cellwright.config.trial.parts import MAX_PARTS, PartRegistry
from cellwright.config.trial.trial import Kit, KitObject, Order
from cellwright.util.errors import suggestion
from cellwright.util.pose import Pose

SHORT_PART = Keys(
    {"type": Reader.name},
    {"xy": quantities((2,), COORDINATE, "[x, y]"), "yaw": ANGLE},
    strict="entry",
    texts="short-parts",
)
"""Keys of a part of a kit in short."""
_PARTS = Elsewhere(lambda: array(SHORT_PART.schema(), 1, MAX_PARTS))
KIT = Keys({"parts": _PARTS}, {"tray": Reader.name}, strict="entry", texts="short-kits")
"""Keys of a kit in short."""
SHORT_ORDER = Keys(
    optional={
        "tray": Reader.name,
        "parts": _PARTS,
        "kits": Elsewhere(lambda: array(KIT.schema(), 1, MAX_PARTS)),
        "after": quantity(0.0, 1e6, "s"),
    },
    strict="entry",
    texts="short-orders",
)
"""Keys of an order in short."""


def is_short(table: Table) -> bool:
    """Return whether an order is in short: with a list of parts, kits or a tray, and no condition of 2017."""
    if "announcement_condition" in table:
        return False
    return isinstance(table.get("parts"), Items) or "kits" in table or "tray" in table


def read_short_order(name: str, table: Table, registry: PartRegistry) -> Order | None:
    """Return an order in short; None after an error."""
    reader, errors = registry.reader, registry.reader.problems.error_count
    values = SHORT_ORDER.read(table, reader)
    if ("parts" in table) == ("kits" in table):
        reader.problems.error(table, "write parts or kits, and one of them")
        return None
    if "kits" in table:
        if "tray" in table:
            reader.problems.error(table.entries["tray"], "belongs into the kits, each of which has its own")
        kits = [kit for each in _items(table.get("kits"), reader) if (kit := reader.table(each))]
        read = [(kit, KIT.read(kit, reader)) for kit in kits]
    else:
        read = [(table, values)]
    found = tuple(_kit(f"{name}_kit_{k}", *each, registry) for k, each in enumerate(read))
    if reader.problems.error_count > errors:
        return None
    after = values.get("after", 0.0)
    return Order("", found, start_time=after, yaml_name=name, written=("time", after))


def _items(node: YamlNode | None, reader: Reader) -> Sequence[YamlNode]:
    """Return the items of a list that must have some."""
    if node is None:
        return ()
    if not isinstance(node, Items) or not 1 <= len(node.items) <= MAX_PARTS:
        found = f"a list of {len(node.items)}" if isinstance(node, Items) else describe(node)
        reader.problems.error(node, f"must be a list of 1 to {MAX_PARTS} mappings (got {found})")
        return ()
    return node.items


def _kit(kit_type: str, table: Table, values: dict[str, Any], registry: PartRegistry) -> Kit:
    reader, layout = registry.reader, registry.layout
    tray = values.get("tray")
    if tray is not None and tray not in {each.name for each in layout.stations}:
        hint = suggestion(tray, [each.name for each in layout.stations])
        reader.problems.error(table.entries["tray"].value, f"the cell has no AGV or tray {shortened(tray)!r}{hint}")
    stations = [each for each in layout.stations if tray in (None, each.name)]
    parts = []
    for item in _items(table.get("parts"), reader):
        part = reader.table(item)
        read = SHORT_PART.read(part, reader) if part else {}
        if part and "type" in read:
            parts.append(_part(part, read, stations, registry))
    return Kit(kit_type, tuple(parts), tray)


def _part(table: Table, values: dict[str, Any], stations: Sequence[Station], registry: PartRegistry) -> KitObject:
    kind = registry.known_type(values["type"], table.entries["type"].value) or values["type"]
    x, y = values.get("xy", (0.0, 0.0))
    placement = Placement((x, y, 0.0), (0.0, 0.0, values.get("yaw", 0.0)))
    covered = footprint(kind, placement.pose)
    margins = [covered.margin(Pose(), each.plate) for each in stations] if kind in PART_TYPES else []
    if margins and max(margins) < 0.0:
        message = f"the part would reach over the edge of the tray by {-max(margins) * 1000:.0f} mm; change xy or yaw"
        registry.reader.problems.error(table, message)
    return KitObject(kind, placement.pose, placement)
